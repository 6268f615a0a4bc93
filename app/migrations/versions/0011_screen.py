"""What a participant's screen is like."""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"


def upgrade() -> None:
    op.add_column("participants", sa.Column("screen", sa.String(500)))

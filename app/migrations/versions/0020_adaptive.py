"""What the pairs of an adaptive design were chosen from."""

import sqlalchemy as sa
from alembic import op

revision = "0020"
down_revision = "0017"


def upgrade() -> None:
    op.add_column("participants", sa.Column("design_state", sa.String(), nullable=True))

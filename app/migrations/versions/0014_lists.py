"""Which list of questions a participant has."""

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"


def upgrade() -> None:
    op.add_column("participants", sa.Column("list_number", sa.Integer()))

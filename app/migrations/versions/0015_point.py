"""Which point of the scale was given, of scales finer than the strengths that count."""

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"


def upgrade() -> None:
    op.add_column("responses", sa.Column("point", sa.Integer()))

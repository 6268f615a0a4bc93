"""How long a pair was looked at beside its reference."""

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"


def upgrade() -> None:
    op.add_column("responses", sa.Column("triplet_ms", sa.Integer()))
    op.add_column("responses", sa.Column("boosted_ms", sa.Integer()))

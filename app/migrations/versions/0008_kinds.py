"""What a trial is for: those that count, and those that tell how well people look."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"


def upgrade() -> None:
    op.add_column("trials", sa.Column("kind", sa.String(8), nullable=False, server_default="main"))

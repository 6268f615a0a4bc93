"""The code that pays and the key that withdraws are two secrets."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    op.add_column("participants", sa.Column("withdrawal_key", sa.String(16)))
    op.create_index(
        "ix_participants_withdrawal_key", "participants", ["withdrawal_key"], unique=True
    )

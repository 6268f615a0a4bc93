"""Who a recruiter's link says that somebody is takes part once."""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"


def upgrade() -> None:
    op.add_column("participants", sa.Column("recruit_id", sa.String(100)))
    op.create_index("ix_participants_recruit_id", "participants", ["recruit_id"], unique=True)

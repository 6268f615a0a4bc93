"""A code with which a participant goes on in another browser."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    op.add_column("participants", sa.Column("resume_code", sa.String(16)))
    op.create_index("ix_participants_resume_code", "participants", ["resume_code"], unique=True)

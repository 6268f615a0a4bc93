"""In which language people agreed and were asked."""

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"


def upgrade() -> None:
    op.add_column("participants", sa.Column("consent_language", sa.String(16)))
    op.add_column("participants", sa.Column("consent_sha256", sa.String(64)))
    op.add_column("responses", sa.Column("language", sa.String(16)))

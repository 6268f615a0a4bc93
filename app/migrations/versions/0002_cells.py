"""A trial belongs to a cell: one level of each factor, which may be framing alone."""

from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    # not by a new table: rows of responses point at the old one
    op.execute("ALTER TABLE trials RENAME COLUMN framing TO cell")

"""What participants see is kept; a study has states, quotas and a log; people can be left out."""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"

TIME = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.add_column("study", sa.Column("content", sa.String))
    op.add_column("study", sa.Column("state", sa.String(6), nullable=False, server_default="open"))
    op.add_column("study", sa.Column("quota", sa.Integer))
    op.add_column(
        "study",
        sa.Column("reservation_minutes", sa.Integer, nullable=False, server_default="120"),
    )
    op.add_column(
        "participants",
        sa.Column("pilot", sa.Boolean, nullable=False, server_default=sa.false()),
    )
    op.add_column("participants", sa.Column("recruit", sa.String(2000)))
    op.add_column("participants", sa.Column("excluded_at", TIME))
    op.add_column("participants", sa.Column("excluded_because", sa.String(500)))
    op.create_table(
        "log",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("at", TIME, nullable=False),
        sa.Column("action", sa.String(40), nullable=False),
        sa.Column("detail", sa.String(1000), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_log"),
    )

"""The numbers of the dashboard are kept for all who look."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"

TIME = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.create_table(
        "live",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("about", sa.String(50), nullable=False),
        sa.Column("made_at", TIME, nullable=False),
        sa.Column("next_at", TIME, nullable=False),
        sa.Column("claimed_until", TIME),
        sa.Column("numbers", sa.String, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_live"),
        sa.CheckConstraint("id = 1", name=op.f("ck_live_one_row")),
    )

"""Answers to a study's own questions, and reasons for a choice."""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"

TIME = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.create_table(
        "statements",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("participant_id", sa.Integer, nullable=False),
        sa.Column("name", sa.String(100), nullable=False),
        sa.Column("value", sa.String(2000), nullable=False),
        sa.Column("at", TIME, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_statements"),
        sa.ForeignKeyConstraint(
            ["participant_id"], ["participants.id"], name="fk_statements_participant_id"
        ),
        sa.UniqueConstraint("participant_id", "name", name="uq_statements_participant_id_name"),
    )
    op.add_column("responses", sa.Column("reason_ticks", sa.String(100)))
    op.add_column("responses", sa.Column("reason_text", sa.String(2000)))

"""The first schema: study, participants, trials, responses, events."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None

TIME = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.create_table(
        "study",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("kind", sa.String(9), nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("version", sa.Integer, nullable=False),
        sa.Column("seed", sa.BigInteger, nullable=False),
        sa.Column("design", sa.String, nullable=False),
        sa.Column("secret_key", sa.String(64), nullable=False),
        sa.Column("password_hash", sa.String(255)),
        sa.Column("simulation_seed", sa.BigInteger),
        sa.Column("created_at", TIME, nullable=False),
        sa.CheckConstraint("kind IN ('real', 'simulated')", name=op.f("ck_study_kind")),
        sa.CheckConstraint("id = 1", name=op.f("ck_study_one_row")),
        sa.PrimaryKeyConstraint("id", name="pk_study"),
    )
    op.create_table(
        "participants",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("visit", sa.String(64), nullable=False),
        sa.Column("consented_at", TIME, nullable=False),
        sa.Column("familiarity", sa.Integer),
        sa.Column("completion_code", sa.String(16)),
        sa.Column("completed_at", TIME),
        sa.Column("withdrawn_at", TIME),
        sa.PrimaryKeyConstraint("id", name="pk_participants"),
        sa.UniqueConstraint("visit", name="uq_participants_visit"),
        sa.UniqueConstraint("completion_code", name="uq_participants_completion_code"),
        sqlite_autoincrement=True,
    )
    op.create_table(
        "trials",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("participant_id", sa.Integer, nullable=False),
        sa.Column("order", sa.Integer, nullable=False),
        sa.Column("framing", sa.String(100), nullable=False),
        sa.Column("left", sa.String(100), nullable=False),
        sa.Column("right", sa.String(100), nullable=False),
        sa.Column("seed", sa.String(50), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_trials"),
        sa.ForeignKeyConstraint(
            ["participant_id"], ["participants.id"], name="fk_trials_participant_id"
        ),
        sa.UniqueConstraint("participant_id", "order", name="uq_trials_participant_id_order"),
    )
    op.create_index("ix_trials_participant_id", "trials", ["participant_id"])
    op.create_table(
        "responses",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("participant_id", sa.Integer, nullable=False),
        sa.Column("trial_id", sa.Integer, nullable=False),
        sa.Column("answer", sa.Integer, nullable=False),
        sa.Column("rt_ms", sa.Integer, nullable=False),
        sa.Column("timed_by", sa.String(7), nullable=False),
        sa.Column("times_shown", sa.Integer, nullable=False),
        sa.Column("started_at", TIME, nullable=False),
        sa.Column("answered_at", TIME, nullable=False),
        sa.Column("image_left_sha256", sa.String(64), nullable=False),
        sa.Column("image_right_sha256", sa.String(64), nullable=False),
        sa.Column("viewport_width", sa.Integer),
        sa.Column("viewport_height", sa.Integer),
        sa.Column("device_pixel_ratio", sa.Double),
        sa.Column("shown_width", sa.Double),
        sa.Column("shown_height", sa.Double),
        sa.PrimaryKeyConstraint("id", name="pk_responses"),
        sa.ForeignKeyConstraint(
            ["participant_id"], ["participants.id"], name="fk_responses_participant_id"
        ),
        sa.ForeignKeyConstraint(["trial_id"], ["trials.id"], name="fk_responses_trial_id"),
        sa.UniqueConstraint(
            "participant_id", "trial_id", name="uq_responses_participant_id_trial_id"
        ),
        sa.UniqueConstraint("trial_id", name="uq_responses_trial_id"),
        sa.CheckConstraint("answer BETWEEN -2 AND 2", name=op.f("ck_responses_answer")),
        sa.CheckConstraint("rt_ms >= 0", name=op.f("ck_responses_rt_ms")),
    )
    op.create_table(
        "events",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("participant_id", sa.Integer, nullable=False),
        sa.Column("trial_id", sa.Integer),
        sa.Column("kind", sa.String(20), nullable=False),
        sa.Column("detail", sa.String(200)),
        sa.Column("at", TIME, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_events"),
        sa.ForeignKeyConstraint(
            ["participant_id"], ["participants.id"], name="fk_events_participant_id"
        ),
        sa.ForeignKeyConstraint(["trial_id"], ["trials.id"], name="fk_events_trial_id"),
    )
    op.create_index(
        "ix_events_participant_id_trial_id_kind", "events", ["participant_id", "trial_id", "kind"]
    )

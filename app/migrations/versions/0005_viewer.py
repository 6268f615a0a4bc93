"""How a pair was looked at, for how long, and what the server's clock says of the time."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"


def upgrade() -> None:
    op.add_column("responses", sa.Column("view", sa.String(10)))
    for name in ("beside_ms", "flicker_ms", "wipe_ms", "away_ms", "flips", "rt_server_ms"):
        op.add_column("responses", sa.Column(name, sa.Integer))
    for name in ("pixel_scale", "pixel_scale_largest", "seen_share"):
        op.add_column("responses", sa.Column(name, sa.Double))
    op.add_column("responses", sa.Column("rt_reported_ms", sa.Integer))

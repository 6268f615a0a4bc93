"""What the experimenter sees, behind a password: progress, live results, balance of sides,
downloads.
"""

from app.dashboard.views import blueprint

__all__ = ["blueprint"]

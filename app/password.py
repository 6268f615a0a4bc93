"""The password of the dashboard: generated, shown once, kept only as a hash;
and who is logged in.
"""

from __future__ import annotations

import hashlib
import secrets
import time

from flask import current_app, session
from werkzeug.security import check_password_hash, generate_password_hash

from app.database import Database
from app.models import StudyRecord
from app.web import database

#: 16 characters that cannot be mistaken for each other: 79 bits.
ALPHABET = "abcdefghjkmnpqrstuvwxyz23456789"
LOGIN_LIFETIME_S = 12 * 3600


def reset(db: Database) -> str:
    """Set a new random password and return it; it is stored nowhere but as a scrypt hash."""
    password = "-".join("".join(secrets.choice(ALPHABET) for _ in range(4)) for _ in range(4))
    with db.write() as session:
        session.get_one(StudyRecord, 1).password_hash = generate_password_hash(
            password, method="scrypt"
        )
    return password


def log_in(password: str) -> bool:
    """Log this browser in if the password is right."""
    stored = _stored()
    if stored is None or not check_password_hash(stored, password.strip()):
        return False
    session["dashboard"] = {"password": _fingerprint(stored), "at": int(time.time())}
    session.permanent = True
    return True


def log_out() -> None:
    session.pop("dashboard", None)


def logged_in() -> bool:
    """Whether this browser gave the password that is in force, not too long ago."""
    stored, login = _stored(), session.get("dashboard")
    return bool(
        stored
        and login
        and login["password"] == _fingerprint(stored)
        and time.time() - login["at"] < LOGIN_LIFETIME_S
    )


def _stored() -> str | None:
    return current_app.config["PASSWORD_HASH"] or database().record().password_hash


def _fingerprint(stored: str) -> str:
    """Ends every login when the password is changed."""
    return hashlib.sha256(stored.encode()).hexdigest()[:16]

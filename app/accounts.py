"""Accounts of researchers: names, roles, passwords, who is signed in; without the web.

They belong to a server and stand in one database, that of its first study. A password is kept as a
hash by argon2id, a sign-in as the hash of a random token that only the browser has, so that who
reads the database can be nobody else. Every function takes the session of a write transaction
(`Database.write`) unless it says otherwise, and writes who changed what into the log of accounts.
"""

from __future__ import annotations

import hashlib
import re
import secrets
import unicodedata
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import cache

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError
from sqlalchemy import delete, func, or_, select
from sqlalchemy.orm import Session
from werkzeug.security import check_password_hash

from app.errors import InputError
from app.models import Account, AccountEntry, SignIn, now

#: What each role may do, in words.
ROLES = {
    "owner": "sees and changes everything",
    "viewer": "sees the dashboard and its downloads, and changes nothing",
}
#: The account that is made at the first start.
FIRST = "owner"
#: Who changes something by the command line.
COMMAND = "command line"
#: No name begins with what a spreadsheet takes for a formula.
NAME = re.compile(r"[a-z0-9][a-z0-9._@+-]{0,63}")
#: Characters of a password. The longest keeps hashing from being a burden.
SHORTEST, LONGEST = 12, 1000
#: 16 characters that cannot be mistaken for each other: 79 bits.
ALPHABET = "abcdefghjkmnpqrstuvwxyz23456789"
LIFETIME = timedelta(hours=12)
#: Argon2id with 19 MiB, 2 passes, 1 lane: the least that OWASP's Password Storage Cheat Sheet asks
#: for, since a guess must not cost the machine of a running study more than that.
HASHER = PasswordHasher(time_cost=2, memory_cost=19 * 1024, parallelism=1)


@dataclass(frozen=True)
class Researcher:
    """Who is signed in. mark: tells this sign-in from others, and is no secret."""

    name: str
    role: str
    mark: str

    @property
    def owner(self) -> bool:
        return self.role == "owner"


def generated() -> str:
    """A random password."""
    return "-".join("".join(secrets.choice(ALPHABET) for _ in range(4)) for _ in range(4))


def hashed(password: str) -> str:
    """InputError where the password is too short or too long."""
    plain = _plain(password)
    if not SHORTEST <= len(plain) <= LONGEST:
        raise InputError(
            f"the password has {len(plain)} characters; expected {SHORTEST} to {LONGEST}"
        )
    return HASHER.hash(plain)


def verified(stored: str | None, password: str) -> bool:
    """Whether a password is the one; None takes as long and is none."""
    plain = _plain(password)
    if len(plain) > LONGEST:
        return False
    if stored and stored.startswith("scrypt:"):  # of a release before there were accounts
        return check_password_hash(stored, plain)
    try:
        HASHER.verify(stored or _nobody(), plain)
    except (VerificationError, InvalidHashError):
        return False
    return stored is not None


@cache
def _nobody() -> str:
    """A hash that no password has, to compare with where there is no such account."""
    return HASHER.hash(secrets.token_hex(32))


def _plain(password: str) -> str:
    """A password as it is hashed, however it was typed or pasted."""
    return unicodedata.normalize("NFC", password).strip()


def find(session: Session, name: str) -> Account | None:
    """The account of that name, however it was typed (read)."""
    return session.scalar(select(Account).filter_by(name=name.strip().lower()))


def named(session: Session, name: str) -> Account:
    """The same; InputError where there is none."""
    account = find(session, name)
    if account is None:
        known = ", ".join(session.scalars(select(Account.name).order_by(Account.name)))
        raise InputError(f"there is no account {name!r}; expected one of {known or 'none'}")
    return account


def add(session: Session, name: str, role: str, password: str, *, who: str) -> Account:
    plain = name.strip().lower()
    if not NAME.fullmatch(plain):
        raise InputError(
            f"the name is {name!r}; expected letters, digits and . _ @ + -, 64 at most, the first "
            "a letter or digit"
        )
    if find(session, plain):
        raise InputError(f"there is an account {plain!r} already")
    account = Account(name=plain, role=role, password_hash=hashed(password))
    session.add(account)
    session.flush()
    note(session, "account added", f"{plain}, {role}", who=who)
    return account


def add_first(session: Session) -> str | None:
    """Where there is no account at all, an owner; gives the password, which is stored nowhere."""
    if session.scalar(select(Account.id).limit(1)) is not None:
        return None
    password = generated()
    add(session, FIRST, "owner", password, who="first start")
    return password


def set_password(session: Session, account: Account, password: str, *, who: str) -> None:
    """Change a password, which ends every sign-in of the account."""
    account.password_hash = hashed(password)
    _end_all(session, account)
    note(session, "password changed", account.name, who=who)


def set_role(session: Session, account: Account, role: str, *, who: str) -> None:
    if account.role != role:
        _keep_an_owner(session, account)
        note(session, "role changed", f"{account.name}: {account.role} to {role}", who=who)
        account.role = role


def remove(session: Session, account: Account, *, who: str) -> None:
    """Take an account away; what it did stays in the logs under its name."""
    _keep_an_owner(session, account)
    _end_all(session, account)
    note(session, "account removed", f"{account.name}, {account.role}", who=who)
    session.delete(account)


def _keep_an_owner(session: Session, account: Account) -> None:
    # the rows are locked, so that of two owners not both go at once
    owners = session.scalars(select(Account).filter_by(role="owner").with_for_update()).all()
    if owners == [account]:
        raise InputError(f"{account.name} is the only owner; make another one first")


def sign_in(session: Session, account: Account, *, ending: str | None) -> str:
    """A new sign-in of the account: its token, which the browser alone has. Ends the one that the
    browser had before, and those that are too old.
    """
    stale = [SignIn.at < now() - LIFETIME]
    if ending:
        stale.append(SignIn.token_sha256 == _digest(ending))
    session.execute(delete(SignIn).where(or_(*stale)))
    token = secrets.token_urlsafe(32)
    session.add(SignIn(account_id=account.id, token_sha256=_digest(token)))
    note(session, "signed in", account.role, who=account.name)
    return token


def refresh_hash(account: Account, password: str) -> None:
    """Hash a password that was right anew, where its hash is of an older kind."""
    old = account.password_hash
    if old.startswith("scrypt:") or HASHER.check_needs_rehash(old):
        account.password_hash = HASHER.hash(_plain(password))


def signed_in(session: Session, token: str) -> Researcher | None:
    """Whose token it is (read); None where it is nobody's or too old."""
    digest = _digest(token)
    row = session.execute(
        select(Account.name, Account.role)
        .join(SignIn, SignIn.account_id == Account.id)
        .where(SignIn.token_sha256 == digest, SignIn.at >= now() - LIFETIME)
    ).one_or_none()
    return row and Researcher(row.name, row.role, digest[:16])


def sign_out(session: Session, token: str) -> None:
    researcher = signed_in(session, token)
    session.execute(delete(SignIn).where(SignIn.token_sha256 == _digest(token)))
    if researcher:
        note(session, "signed out", "", who=researcher.name)


def everybody(session: Session) -> list[tuple[Account, datetime | None]]:
    """All accounts by name, and when each signed in last (read)."""
    last = (
        select(func.max(AccountEntry.at))
        .where(AccountEntry.who == Account.name, AccountEntry.action == "signed in")
        .scalar_subquery()
    )
    return [tuple(row) for row in session.execute(select(Account, last).order_by(Account.name))]


def note(session: Session, action: str, detail: str, *, who: str) -> None:
    """Append to the log of accounts."""
    session.add(AccountEntry(who=who, action=action, detail=detail[:1000]))


def _end_all(session: Session, account: Account) -> None:
    session.execute(delete(SignIn).where(SignIn.account_id == account.id))


def _digest(token: str) -> str:
    """What is stored of a token; it is random enough that a fast hash is safe."""
    return hashlib.sha256(token.encode()).hexdigest()

"""PostgreSQL by pg8000, with few round trips.

pg8000 rewrites a statement character by character, has it parsed and planned and asks what it
gives each time it runs, in three round trips, and waits for every BEGIN, COMMIT and ROLLBACK. Each
wait also hands the interpreter to other threads. So here:

- statements with the option `prepared` are kept by the connection and then take one round trip;
- BEGIN goes out with the first statement, and a reader's ROLLBACK is not waited for;
- COMMIT goes out with a statement that has the option `commits`, which must be the last of its
  transaction. If that statement fails, PostgreSQL makes a rollback of it;
- whether a connection still stands is looked up in the socket: a server that ended has closed it.
"""

from __future__ import annotations

import selectors
from collections.abc import Sequence
from typing import Any

from sqlalchemy import Engine, event


def listen(engine: Engine) -> None:
    """Let an engine of the dialect postgresql+pg8000 connect and execute so."""
    from pg8000 import core
    from pg8000.dbapi import Connection, DatabaseError, IntegrityError, convert_paramstyle

    class Kept(Connection):
        """A connection that knows its prepared statements and the replies that it has not read."""

        def __init__(self, *args: Any, **kwargs: Any):
            self._unread: list[str] = []  # simple queries that were sent
            super().__init__(*args, **kwargs)
            self._kept: dict[str, tuple] = {}

        def handle_messages(self, context: Any) -> None:
            """Read a reply, after those of what was sent before."""
            self._read_all()
            self._handle(context)

        def _handle(self, context: Any) -> None:
            try:
                super().handle_messages(context)
            except DatabaseError as error:
                # pg8000 has one error for all; class 23 is of constraints (SQLSTATE)
                said = error.args[0] if error.args and isinstance(error.args[0], dict) else {}
                if str(said.get("C", "")).startswith("23"):
                    raise IntegrityError(*error.args) from error
                raise

        def _send(self, query: str) -> None:
            """A simple query, at the latest with what is asked next; its reply is read then."""
            self.send_QUERY(query)
            self._unread.append(query)

        def _read_all(self) -> None:
            while self._unread:
                self._handle(core.Context(self._unread.pop(0)))

        def begin(self, how: str) -> None:
            self._send(how)
            self._transaction_status = core.IN_TRANSACTION  # what cursors ask before they begin one

        def commit(self) -> None:
            if self._unread != ["commit"]:  # not sent with the last statement
                self._send("commit")
                core._flush(self._sock)
            self._read_all()

        def rollback(self) -> None:
            if self._in_transaction:
                self._send("rollback")
                core._flush(self._sock)
                self._transaction_status = core.IDLE

        def stands(self) -> bool:
            """Whether the other end has not closed the connection; raises where it says why."""
            try:
                self._read_all()
            except OSError:  # reset, which the driver lets through where it reads a reply's start
                return False
            with selectors.DefaultSelector() as sockets:
                sockets.register(self._usock, selectors.EVENT_READ)
                if sockets.select(0):  # closed, or a notice that nobody waits for
                    self.execute_simple("select 1")
            return True

        def run_prepared(self, statement: str, values: Sequence[Any], commits: bool):
            """What the driver keeps of a statement that ran."""
            if statement not in self._kept:
                text, _ = convert_paramstyle("format", statement, values)
                self._kept[statement] = (*self.prepare_statement(text, ()), text)
            name, columns, reads, text = self._kept[statement]
            values = core.make_params(self.py_types, values)
            if not commits:
                return self.execute_named(name, values, columns, reads, text)
            context = core.Context(columns=columns, input_funcs=reads, statement=text)
            self.send_BIND(name, values)
            self.send_EXECUTE()
            self._sock.write(core.SYNC_MSG)
            self.send_QUERY("commit")
            core._flush(self._sock)
            ending = "rollback"
            try:
                self.handle_messages(context)
                ending = "commit"
            finally:
                self._unread.append(ending)
            return context

    def connect(_dialect, _record, args, parameters):
        return Kept(*args, **parameters)

    def execute(cursor, statement, values, context) -> bool | None:
        connection = getattr(cursor, "cursor", cursor)._c  # one of the server's is wrapped
        if connection._unread == ["commit"]:
            raise RuntimeError("a statement after the one that commits its transaction")
        options = {} if context is None else context.execution_options
        if not options.get("prepared"):
            return None
        done = connection.run_prepared(statement, values, options.get("commits", False))
        cursor._context = done
        cursor._row_iter = None if done.rows is None else iter(done.rows)
        return True

    def begin(connection) -> None:
        """A reader sees one snapshot, as it does in SQLite; writers lock the rows that they decide
        by.
        """
        writes = connection.get_execution_options().get("writes", False)
        isolation = "read committed" if writes else "repeatable read"
        connection.connection.driver_connection.begin(f"begin isolation level {isolation}")

    engine.dialect.do_ping = Kept.stands
    event.listen(engine, "do_connect", connect)
    event.listen(engine, "begin", begin)
    event.listen(engine, "do_execute", execute)

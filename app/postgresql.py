"""PostgreSQL by pg8000, with what every answer asks for prepared once a connection.

pg8000 rewrites a statement character by character, has it parsed and planned and asks what it
gives each time it runs, in three round trips; for a commit too. Statements with the option
`prepared` are kept by the connection, and each then takes one round trip; BEGIN, COMMIT and
ROLLBACK go as simple queries.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sqlalchemy import Engine, event


def listen(engine: Engine) -> None:
    """Let an engine of the dialect postgresql+pg8000 connect and execute so."""
    from pg8000.core import make_params
    from pg8000.dbapi import Connection, DatabaseError, IntegrityError, convert_paramstyle

    class Kept(Connection):
        """A connection that knows its prepared statements."""

        def __init__(self, *args: Any, **kwargs: Any):
            super().__init__(*args, **kwargs)
            self._kept: dict[str, tuple] = {}

        def handle_messages(self, context: Any) -> None:
            try:
                super().handle_messages(context)
            except DatabaseError as error:
                # pg8000 has one error for all; class 23 is of constraints (SQLSTATE)
                said = error.args[0] if error.args and isinstance(error.args[0], dict) else {}
                if str(said.get("C", "")).startswith("23"):
                    raise IntegrityError(*error.args) from error
                raise

        def begin(self, how: str) -> None:
            self.execute_simple(how)

        def commit(self) -> None:
            self.execute_simple("commit")

        def rollback(self) -> None:
            if self._in_transaction:
                self.execute_simple("rollback")

        def run_prepared(self, statement: str, values: Sequence[Any]):
            """What the driver keeps of a statement that ran."""
            if statement not in self._kept:
                text, _ = convert_paramstyle("format", statement, values)
                self._kept[statement] = (*self.prepare_statement(text, ()), text)
            name, columns, reads, text = self._kept[statement]
            return self.execute_named(
                name, make_params(self.py_types, values), columns, reads, text
            )

    def connect(_dialect, _record, args, parameters):
        return Kept(*args, **parameters)

    def execute(cursor, statement, values, context) -> bool | None:
        if context is None or not context.execution_options.get("prepared"):
            return None
        done = cursor._c.run_prepared(statement, values)
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

    def ping(connection) -> bool:
        connection.execute_simple("select 1")  # by a cursor it would begin a transaction
        return True

    engine.dialect.do_ping = ping
    event.listen(engine, "do_connect", connect)
    event.listen(engine, "begin", begin)
    event.listen(engine, "do_execute", execute)

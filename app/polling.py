"""The loop of waitress over sockets that mostly say nothing.

Waitress asks every socket before each wait whether it has something to read or to write: with a
browser's three connections and 500 browsers that is more work than answering them, and it holds up
the threads that do. Here the system says which sockets are ready, and only those at which something
is going on are asked.
"""

from __future__ import annotations

import select
import selectors
import time

from waitress import wasyncore

READ, WRITE = selectors.EVENT_READ, selectors.EVENT_WRITE
#: Waitress tells silent sockets to close: they are asked about that so often.
ASKED_EVERY_S = 1.0


class Watched(dict[int, wasyncore.dispatcher]):
    """What waitress keeps its sockets in, by their numbers (the `map` of `create_server`)."""

    def __init__(self):
        super().__init__()
        self._selector = selectors.DefaultSelector()
        self._busy: set[int] = set()  # sockets to ask before the next wait

    def __setitem__(self, number: int, one: wasyncore.dispatcher) -> None:
        super().__setitem__(number, one)
        self._busy.add(number)

    def __delitem__(self, number: int) -> None:
        super().__delitem__(number)
        self._busy.discard(number)
        self._wait_for(number, 0)

    def run(self) -> None:
        """Serve until no socket is left."""
        all_asked = 0.0
        while self:
            if (now := time.monotonic()) - all_asked >= ASKED_EVERY_S:
                all_asked = now
                self._busy.update(self)
            for number in list(self._busy):
                if number in self:  # asking one may close another
                    self._ask(number)
            for key, events in self._selector.select(ASKED_EVERY_S):
                self._handle(key.fd, events)

    def _ask(self, number: int) -> None:
        one = self[number]
        wanted = READ if one.readable() else 0
        if one.writable() and not one.accepting:
            wanted |= WRITE
        if wanted:  # who is being answered is still listened to: that they say more is rare
            self._wait_for(number, wanted)
        if wanted == READ and not one.accepting:  # who listens also looks after the others
            self._busy.discard(number)

    def _wait_for(self, number: int, events: int) -> None:
        key = self._selector.get_map().get(number)
        if key is None:
            if events:
                self._selector.register(number, events)
        elif not events:
            self._selector.unregister(number)
        elif events != key.events:
            self._selector.modify(number, events)

    def _handle(self, number: int, events: int) -> None:
        one = self.get(number)
        if one is None:  # closed by what another did
            return
        self._busy.add(number)
        flags = select.POLLOUT if events & WRITE and one.writable() else 0
        if events & READ and one.readable():
            flags |= select.POLLIN
        if flags:
            wasyncore.readwrite(one, flags)
        else:
            self._wait_for(number, 0)  # it would be said again and again

"""What each pass takes: wall and CPU time, and the graphics card's own where there is one.

A card's time is a timer query's (GL_TIME_ELAPSED, OpenGL 3.3). Software OpenGL is a processor's
work, and CPU time is what it takes; its timer queries measure nothing else.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from renderer.gl.context import GL, Context
from renderer.gl.mesh import finish

SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software")


@dataclass(frozen=True)
class Pass:
    """name: of its shader; seconds of wall, CPU and card time, the last nan on software OpenGL."""

    name: str
    wall: float
    cpu: float
    card: float


@dataclass
class Clock:
    """Put it in a context's `clock`, and every pass of a technique is one more of `passes`."""

    software: bool
    passes: list[Pass] = field(default_factory=list)

    @classmethod
    def of(cls, renderer_name: str) -> Clock:
        """For a driver, by the name that it gives its renderer (GL_RENDERER)."""
        return cls(any(word in renderer_name.lower() for word in SOFTWARE))

    @contextmanager
    def timed(self, name: str) -> Iterator[None]:
        """Time what is drawn in the block; all that was asked for before is finished first."""
        finish()
        query = None if self.software else int(GL.glGenQueries(1))
        start = time.perf_counter(), time.process_time()
        if query:
            GL.glBeginQuery(GL.GL_TIME_ELAPSED, query)
        try:
            yield
        finally:
            if query:
                GL.glEndQuery(GL.GL_TIME_ELAPSED)
            finish()
        wall, cpu = time.perf_counter() - start[0], time.process_time() - start[1]
        card = float("nan")
        if query:
            card = 1e-9 * float(GL.glGetQueryObjectui64v(query, GL.GL_QUERY_RESULT))
            GL.glDeleteQueries(1, [query])
        self.passes.append(Pass(name, wall, cpu, card))


@contextmanager
def timed(context: Context, name: str) -> Iterator[None]:
    """The block, timed where the context has a clock."""
    if context.clock is None:
        yield
        return
    with context.clock.timed(name):
        yield

"""Shader programs: GLSL files with includes and defines; every uniform is set or refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from renderer.gl.context import GL

ROOT = Path(__file__).parents[1]


def source(path: str, defines: dict[str, object] | None = None) -> str:
    """GLSL text of `path` (relative to renderer/) with `#include "x"` and defines resolved."""

    def read(name: str, seen: tuple[str, ...]) -> str:
        file = ROOT / name
        if name in seen:
            raise ValueError(f"{seen[-1]}: includes {name} in a circle")
        if not file.is_file():
            raise ValueError(f"{seen[-1] if seen else name}: no shader {name}")
        text = file.read_text(encoding="utf-8")
        return re.sub(
            r'^#include "([^"]+)"\s*$', lambda m: read(m[1], (*seen, name)), text, flags=re.M
        )

    head = "#version 330 core\n" + "".join(f"#define {k} {v}\n" for k, v in (defines or {}).items())
    return head + read(path, ())


_SAMPLERS = {
    GL.GL_SAMPLER_2D: GL.GL_TEXTURE_2D,
    GL.GL_SAMPLER_2D_ARRAY: GL.GL_TEXTURE_2D_ARRAY,
}
_FLOATS = {  # type -> setter of (location, count, values)
    GL.GL_FLOAT: GL.glUniform1fv,
    GL.GL_FLOAT_VEC2: GL.glUniform2fv,
    GL.GL_FLOAT_VEC3: GL.glUniform3fv,
    GL.GL_FLOAT_VEC4: GL.glUniform4fv,
}
_MATRICES = {GL.GL_FLOAT_MAT3: GL.glUniformMatrix3fv, GL.GL_FLOAT_MAT4: GL.glUniformMatrix4fv}


class Program:
    """A linked program. `vertex`, `fragment` and `geometry` are files relative to renderer/."""

    def __init__(
        self,
        fragment: str,
        vertex: str = "shaders/fullscreen.vert",
        defines: dict[str, object] | None = None,
        geometry: str | None = None,
    ):
        self.name = fragment
        self.id = GL.glCreateProgram()
        stages = [(GL.GL_VERTEX_SHADER, vertex), (GL.GL_FRAGMENT_SHADER, fragment)]
        if geometry is not None:
            stages.append((GL.GL_GEOMETRY_SHADER, geometry))
        for kind, path in stages:
            shader = GL.glCreateShader(kind)
            GL.glShaderSource(shader, source(path, defines))
            GL.glCompileShader(shader)
            if not GL.glGetShaderiv(shader, GL.GL_COMPILE_STATUS):
                raise RuntimeError(f"{path}: {GL.glGetShaderInfoLog(shader).decode()}")
            GL.glAttachShader(self.id, shader)
            GL.glDeleteShader(shader)
        GL.glLinkProgram(self.id)
        if not GL.glGetProgramiv(self.id, GL.GL_LINK_STATUS):
            raise RuntimeError(f"{fragment}: {GL.glGetProgramInfoLog(self.id).decode()}")
        self._uniforms = {}
        for index in range(GL.glGetProgramiv(self.id, GL.GL_ACTIVE_UNIFORMS)):
            name, size, kind = GL.glGetActiveUniform(self.id, index)
            name = (name.decode() if isinstance(name, bytes) else name).split("[")[0]
            self._uniforms[name] = (GL.glGetUniformLocation(self.id, name), size, kind)

    def use(self, **values) -> None:
        """Bind the program and set its uniforms; one left out or unknown is an error."""
        missing = self._uniforms.keys() - values.keys()
        unknown = values.keys() - self._uniforms.keys()
        if missing:
            raise ValueError(f"{self.name}: uniforms not given: {', '.join(sorted(missing))}")
        if unknown:
            raise ValueError(f"{self.name}: no such uniforms: {', '.join(sorted(unknown))}")
        GL.glUseProgram(self.id)
        unit = 0
        for name, value in values.items():
            where, size, kind = self._uniforms[name]
            if kind in _SAMPLERS:
                GL.glActiveTexture(GL.GL_TEXTURE0 + unit)
                GL.glBindTexture(_SAMPLERS[kind], value.id)
                GL.glUniform1i(where, unit)
                unit += 1
            elif kind in (GL.GL_INT, GL.GL_BOOL):
                GL.glUniform1iv(where, size, np.ascontiguousarray(value, dtype=np.int32))
            elif kind == GL.GL_INT_VEC2:
                GL.glUniform2iv(where, size, np.ascontiguousarray(value, dtype=np.int32))
            elif kind in _FLOATS:
                _FLOATS[kind](where, size, np.ascontiguousarray(value, dtype=np.float32))
            elif kind in _MATRICES:
                matrix = np.ascontiguousarray(value, dtype=np.float32)
                _MATRICES[kind](where, size, GL.GL_TRUE, matrix)
            else:
                raise ValueError(
                    f"{self.name}: uniform {name} has a type that this program does not set"
                )

    def accepts(self, values: dict) -> dict:
        """Those of `values` that this program has as active uniforms (for blocks shared by many
        programs).
        """
        return {name: value for name, value in values.items() if name in self._uniforms}

"""A generated person's model as arrays, so that it is made once: see renderer.caches."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from renderer import caches
from renderer.scene import Eye, Model, Proxy, Strands, Surface
from renderer.scene.material import Skin
from stimuli import sources
from stimuli.heads import anatomy, fetch
from stimuli.heads.default_head import default_model
from stimuli.heads.eyes import COLOURS, values_of
from stimuli.heads.person import Person

SURFACE = ("positions", "normals", "uvs", "faces", "masks")
PROXY = ("positions", "normals", "faces", "albedo", "masks")
EYE = ("positions", "normals", "faces", "centre", "gaze", "radius", "iris_radius")
EYE += ("tissue", "edges", "edges_mm", "vessels")
STRANDS = ("points", "width_mm", "colour", "cover", "root_vertex")
SPARSE = ("data", "indices", "indptr", "shape")


def person_model(person: Person, seed: int) -> Model:
    """The model of a person, from the cache where it was made before; base data are fetched."""
    code = sources.modules("stimuli.heads.default_head")
    key = caches.key((person, seed, fetch.SHA256), code, ("numpy", "scipy", "trimesh", "embreex"))

    def make() -> caches.Arrays:
        made = anatomy.build_anatomy(fetch.mpfb_data(), person)
        return arrays_of(default_model(made, seed, person=person))

    return model_of(caches.kept("people", key, make), person)


def arrays_of(model: Model) -> caches.Arrays:
    """A generated person's model, without what its material says."""
    proxy, strands = model.surface.proxy, model.strands
    arrays = {f"surface_{name}": getattr(model.surface, name) for name in SURFACE}
    arrays |= {f"proxy_{name}": getattr(proxy, name) for name in PROXY}
    arrays |= {f"to_full_{name}": np.asarray(getattr(proxy.to_full, name)) for name in SPARSE}
    arrays |= {f"strands_{name}": getattr(strands, name) for name in STRANDS}
    arrays |= {f"landmark_{name}": place for name, place in model.landmarks.items()}
    for k, eye in enumerate(model.eyes):
        arrays |= {f"eye{k}_{name}": np.asarray(getattr(eye, name)) for name in EYE}
    return arrays


def model_of(arrays: caches.Arrays, person: Person) -> Model:
    """The model again, with the person's own colours."""

    def named(prefix: str) -> dict:
        return {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}

    matrix = named("to_full_")
    to_full = sparse.csr_matrix(tuple(matrix[name] for name in SPARSE[:3]), tuple(matrix["shape"]))
    shading = {
        "colours": {name: getattr(person.eyes, name) for name in COLOURS},
        "values": values_of(person.eyes),
        "into_lens": person.eyes.gaze == "lens",
    }
    eyes = []
    for k in range(2):
        own = named(f"eye{k}_")
        sizes = {name: float(own[name]) for name in ("radius", "iris_radius")}
        sizes["edges_mm"] = tuple(float(v) for v in own["edges_mm"])
        eyes.append(Eye(**{**own, **sizes, **shading}))
    return Model(
        Surface(**named("surface_"), proxy=Proxy(**named("proxy_"), to_full=to_full)),
        tuple(eyes),
        Strands(**named("strands_")),
        named("landmark_"),
        Skin.read(person.skin, "person.skin"),
    )

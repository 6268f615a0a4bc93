"""A generated person's model as arrays, so that it is made once: see renderer.caches."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from renderer import caches
from renderer.scene import Eye, Model, Proxy, Strands, Surface
from renderer.scene.material import Skin
from stimuli import sources
from stimuli.heads import anatomy, fetch, garment
from stimuli.heads.default_head import default_model
from stimuli.heads.eyes import COLOURS, values_of
from stimuli.heads.person import Person

SURFACE = ("positions", "normals", "uvs", "faces", "masks")
PROXY = ("positions", "normals", "faces", "albedo", "masks")
EYE = ("positions", "normals", "faces", "centre", "gaze", "radius", "iris_radius")
EYE += ("tissue", "edges", "edges_mm", "vessels")
STRANDS = (
    "points",
    "first",
    "width_mm",
    "tip",
    "colour",
    "cover",
    "root_vertex",
    "sheen",
    "leaves_mm",
)
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
    arrays |= {f"strands_{name}": np.asarray(getattr(strands, name)) for name in STRANDS}
    arrays |= {f"landmark_{name}": place for name, place in model.landmarks.items()}
    for k, worn in enumerate(model.garments):
        cloth, own = worn.surface, worn.surface.proxy
        names = (*SURFACE, "scatters")
        arrays |= {f"garment{k}_surface_{name}": getattr(cloth, name) for name in names}
        arrays |= {f"garment{k}_proxy_{name}": getattr(own, name) for name in PROXY[:4]}
        sparse_ones = {name: np.asarray(getattr(own.to_full, name)) for name in SPARSE}
        arrays |= {f"garment{k}_to_full_{name}": value for name, value in sparse_ones.items()}
    for k, eye in enumerate(model.eyes):
        arrays |= {f"eye{k}_{name}": np.asarray(getattr(eye, name)) for name in EYE}
    return arrays


def model_of(arrays: caches.Arrays, person: Person) -> Model:
    """The model again, with the person's own colours."""

    def named(prefix: str) -> dict:
        return {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}

    def matrix(prefix: str) -> sparse.csr_matrix:
        own = named(prefix)
        return sparse.csr_matrix(tuple(own[name] for name in SPARSE[:3]), tuple(own["shape"]))

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
    garments = []
    if person.clothes.kind != "none":
        own = Proxy(**named("garment0_proxy_"), to_full=matrix("garment0_to_full_"))
        cloth = Surface(**named("garment0_surface_"), proxy=own)
        garments.append(garment.dressed(cloth, person.clothes))
    return Model(
        Surface(**named("surface_"), proxy=Proxy(**named("proxy_"), to_full=matrix("to_full_"))),
        tuple(eyes),
        Strands(**named("strands_")),
        named("landmark_"),
        Skin.read(person.skin, "person.skin"),
        tuple(garments),
    )

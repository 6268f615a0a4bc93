"""The default head, drawn small: one model and one context for all tests of the renderer."""

import numpy as np
import pytest

import renderer as package
from renderer import gl
from renderer.scene.graph import SceneGraph
from stimuli import scenes
from stimuli.heads import anatomy as anatomies
from stimuli.heads import fetch
from stimuli.heads.default_head import default_model
from stimuli.heads.person import Person
from stimuli.parts import PEOPLE, read_toml
from tests.renderer.slab import Bare

SIZE = (320, 180)


def studio(model, **patch):
    """A model under the thesis's light, as a graph; patch: over the scene's table."""
    table = scenes.merge(scenes.load_table("thesis"), patch)
    scene = scenes.read_scene(table)
    graph = SceneGraph(scene.environment, scene.picture, model.landmarks["eyes"], scene.camera)
    graph.add_model(model, np.eye(4))
    for light in scene.lights.values():
        graph.add_light(light)
    return graph


def small(name):
    """A technique as it is, but for the size of its atlas, the number of its points or walks."""
    fewer = {
        "atlas": {"size": 256},
        "points": {"spacing_mm": 8.0, "share": 0.9},
        "walks": {"walks": 2},
    }
    return package.make(name, fewer.get(package.TECHNIQUES[name].domain, {}))


MAN = Person.read(read_toml(PEOPLE / "man.toml"), "man")


@pytest.fixture(scope="session")
def stand():
    """stand(model, **patch) -> graph: the model in the studio."""
    return studio


@pytest.fixture(scope="session")
def bare():
    """A context without a scene: pictures that techniques filter."""
    found = Bare()
    yield found
    found.context.close()


@pytest.fixture(scope="session")
def anatomy():
    return anatomies.build_anatomy(fetch.mpfb_data(), MAN)


@pytest.fixture(scope="session")
def model(anatomy):
    return default_model(anatomy, seed=0, hair_share=0.1)


@pytest.fixture(scope="session")
def drawing(model):
    with package.Renderer(studio(model), size=SIZE, supersample=2, seed=0, rays=36) as renderer:
        yield renderer


@pytest.fixture(scope="session")
def frames(drawing):
    return {name: drawing.frame(camera) for name, camera in package.FRAMINGS.items()}


@pytest.fixture(scope="session")
def techniques():
    return {name: small(name) for name in package.TECHNIQUES}


@pytest.fixture(scope="session")
def results(frames, techniques):
    """framing -> technique -> Result; what works on surfaces themselves is drawn at close-up."""
    return {
        f: {
            t: frame.render(technique)
            for t, technique in techniques.items()
            if technique.domain == "screen" or f == "close-up"
        }
        for f, frame in frames.items()
    }


@pytest.fixture
def patch(frames, drawing):
    """Replaces the head by a flat patch that faces the camera: patch(irradiance (H, W, 3),
    depth_mm, mask) -> Inputs.
    """

    def inputs(irradiance, depth_mm=400.0, mask=None):
        drawing.context.make_current()
        frame = frames["close-up"]
        height, width = irradiance.shape[:2]
        assert (width, height) == (frame.width, frame.height)
        mask = np.ones((height, width)) if mask is None else mask
        colour = np.dstack([irradiance, mask]).astype(np.float32)[::-1]
        depth = np.zeros((height, width, 4), dtype=np.float32)
        depth[..., 0], depth[..., 3] = depth_mm, 1
        textures = [
            gl.Texture(width, height, gl.GL.GL_RGBA32F, data=data) for data in (colour, depth[::-1])
        ]
        return frame.inputs(False, *textures)

    return inputs

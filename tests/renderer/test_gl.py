"""Resources are freed, whoever forgets; arrays, geometry shaders and sums are there."""

import gc

import numpy as np
import pytest

from renderer import gl
from renderer.gl import GL


def test_what_is_dropped_is_freed_before_the_next_is_made(drawing):
    drawing.context.make_current()
    target = gl.Target(8, 8, [GL.GL_RGBA16F], depth=True)
    framebuffer = target.id
    mesh = gl.Mesh({0: np.zeros((3, 3))}, np.array([[0, 1, 2]]))
    array = mesh.vertex_array
    assert GL.glIsFramebuffer(framebuffer) and GL.glIsVertexArray(array)
    del target, mesh
    gc.collect()
    gl.Texture(2, 2)
    assert not GL.glIsFramebuffer(framebuffer) and not GL.glIsVertexArray(array)


def test_delete_frees_at_once_and_twice_is_once(drawing):
    drawing.context.make_current()
    texture = gl.Texture(4, 4)
    texture.delete()
    assert not GL.glIsTexture(texture.id)
    texture.delete()


@pytest.mark.parametrize("blend", ["over", "add"])
def test_blending(drawing, blend):
    """Premultiplied colour over another; or the sum of both."""
    drawing.context.make_current()
    texture = gl.Texture(2, 2, GL.GL_RGBA32F, data=np.full((2, 2, 4), 0.5, np.float32))
    with gl.Target(2, 2, [GL.GL_RGBA32F]) as target:
        target.bind(clear=(1.0, 1.0, 1.0, 1.0))
        target.bind(blend=blend)
        drawing.program("passes/copy.frag").use(source=texture, first_row=0)
        gl.draw_fullscreen(drawing.context)
        np.testing.assert_allclose(target.textures[0].read(), 1.5 if blend == "add" else 1.0)


def test_layers_of_depth_are_drawn_one_by_one(drawing):
    drawing.context.make_current()
    depth = gl.DepthArray(4, 3)
    triangle = np.array([[-3, -1, 0], [3, -1, 0], [0, 5, 0]], float)
    for layer in range(3):
        depth.bind_layer(layer)
        mesh = gl.Mesh({0: triangle + [0, 0, 0.25 * layer]}, np.array([[0, 1, 2]]))
        drawing.program("passes/depth.frag", vertex="passes/place.vert").use(clip=np.eye(4))
        mesh.draw()
    got = depth.array.read()[..., 0]
    np.testing.assert_allclose(
        got, np.broadcast_to([[[0.5]], [[0.625]], [[0.75]]], got.shape), atol=2e-5
    )
    depth.delete()


def test_a_geometry_shader_makes_squares_of_points(drawing):
    drawing.context.make_current()
    points = gl.Mesh({0: np.array([[-0.5, -0.5, 0.0], [0.5, 0.5, 0.0]])})
    with gl.Target(16, 16, [GL.GL_RGBA32F]) as target:
        target.bind(clear=(0.0, 0.0, 0.0, 0.0), blend="add")
        gl.Program("passes/white.frag", "passes/place.vert", geometry="passes/square.geom").use(
            clip=np.eye(4), half_size=(0.25, 0.25)
        )
        points.draw()
        got = target.textures[0].read()[::-1, :, 0]
    expected = np.zeros((16, 16))
    expected[2:6, 2:6] = expected[10:14, 10:14] = 1
    np.testing.assert_array_equal(got, expected)

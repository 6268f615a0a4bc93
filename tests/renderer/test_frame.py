"""Whole frames: what techniques share is shared to the bit; bytes repeat; the drivers agree."""

import os
import subprocess
import sys
from ctypes.util import find_library

import numpy as np
import pytest
from PIL import Image

import renderer
from renderer.errors import InputError
from renderer.gl import Program
from renderer.optics.transmittance import Translucency


def no_skin(result, supersample=2):
    """Output pixels none of whose samples sees scattering material."""
    h, w = result.samples.shape
    return (
        result.samples.reshape(h // supersample, supersample, w // supersample, supersample).max(
            axis=(1, 3)
        )
        == 0
    )


def test_where_no_skin_is_seen_all_techniques_agree_to_the_bit(results):
    for framing, by_name in results.items():
        reference = by_name["none"]
        outside = no_skin(reference)
        assert 0.1 < outside.mean() < 0.95, framing
        eyes_and_hair = outside & (
            np.abs(reference.image.astype(int) - reference.image[2, 2]).max(axis=2) > 60
        )
        assert framing == "half-length" or eyes_and_hair.any(), (
            f"{framing}: no eye or hair pixel checked"
        )
        for name, result in by_name.items():
            np.testing.assert_array_equal(
                result.image[outside], reference.image[outside], err_msg=f"{framing} {name}"
            )
            np.testing.assert_array_equal(no_skin(result), outside)


def test_on_skin_every_pair_of_techniques_differs(results):
    """No technique is another under a second name; golubev_plus is close to golubev, none is far
    from all.
    """
    close = results["close-up"]
    skin = ~no_skin(close["none"])

    def distance(a, b):
        return np.abs(close[a].image[skin].astype(float) - close[b].image[skin]).mean()

    names = list(close)
    for i, a in enumerate(names):
        for b in names[i + 1 :]:
            assert distance(a, b) > 0.05, (a, b)
    assert distance("golubev", "golubev_plus") < 0.5 * distance("golubev", "none")


def test_samples_are_counted(results):
    for _framing, by_name in results.items():
        assert set(np.unique(by_name["none"].samples)) == {0, 1}
        assert set(np.unique(by_name["golubev"].samples)) == {0, 22}
        plus = by_name["golubev_plus"]
        assert set(np.unique(plus.samples)) == {0, 12, 22}
        assert plus.contrast is not None and plus.contrast.min() >= 0 and plus.contrast.max() <= 1
        np.testing.assert_array_equal(plus.samples == 22, plus.contrast >= 0.25)
        assert by_name["golubev"].contrast is None


def test_the_light_that_comes_through_is_added_for_scattering_techniques_alone(frames, drawing):
    drawing.context.make_current()
    frame = frames["close-up"]
    plain, lit = frame.irradiance().read(), frame.irradiance(Translucency()).read()
    mask = plain[..., 3] > 0
    np.testing.assert_array_equal(plain[~mask], lit[~mask])
    gain = (lit - plain)[mask][:, :3]
    assert (gain >= 0).all() and gain[:, 0].max() > 0.1 and gain[:, 0].sum() > 2 * gain[:, 2].sum()
    without = {name for name in renderer.TECHNIQUES if renderer.make(name).transmission is None}
    # to splats and walks, light comes through by distance; deon_luebke has maps of its own
    own = {"none", "splat_dipole", "splat_multipole", "reference", "deon_luebke"}
    assert without == own


def test_texturing_before_and_after_agree_where_nothing_is_to_blur(frames):
    """Without scattering, pre, post and both are one picture; with it, pre blurs the albedo too."""
    frame = frames["close-up"]
    post, both, pre = (
        frame.render(renderer.make("none", {"texturing": share})).image.astype(int)
        for share in (0.0, 0.5, 1.0)
    )
    assert np.abs(post - pre).max() <= 1 and np.abs(post - both).max() <= 1
    post, pre = (
        frame.render(renderer.make("golubev", {"texturing": share})) for share in (0.0, 1.0)
    )
    skin = post.samples[::2, ::2] > 0
    rough = [
        np.abs(np.diff(r.image.astype(float), axis=1))[skin[:, 1:]].mean() for r in (post, pre)
    ]
    assert rough[1] < rough[0]
    eyes = ~no_skin(post)
    np.testing.assert_array_equal(post.image[~eyes], pre.image[~eyes])


def test_translucency_is_a_parameter(frames):
    frame, light = frames["close-up"], []
    for model in ("slab", "none"):
        with frame.scatter(renderer.make("golubev", {"translucency": model})) as target:
            light.append(target.textures[0].read()[..., :3].copy())
    lit, dull = light
    assert (lit - dull)[..., 0].max() > 0.1 and (lit >= dull - 1e-3).all()


def test_a_frame_drawn_twice_has_the_same_bytes(model, stand, results):
    with renderer.Renderer(stand(model), size=(320, 180), supersample=2, seed=0, rays=36) as second:
        again = second.frame(renderer.FRAMINGS["head-shot"]).render(renderer.make("golubev_plus"))
    np.testing.assert_array_equal(again.image, results["head-shot"]["golubev_plus"].image)
    np.testing.assert_array_equal(again.samples, results["head-shot"]["golubev_plus"].samples)


def test_another_seed_gives_another_skin(model, stand, results):
    with renderer.Renderer(stand(model), size=(320, 180), supersample=2, seed=1, rays=36) as second:
        other = second.frame(renderer.FRAMINGS["close-up"]).render(renderer.make("none"))
    assert (other.image != results["close-up"]["none"].image).any()


def rendered(platform, folder):
    """The files that the command line writes through one platform: image, samples, contrast."""
    folder.mkdir()
    files = [folder / name for name in ("image.png", "samples.npy", "contrast.png")]
    run = subprocess.run(
        [
            sys.executable,
            "-m",
            "app.cli",
            "render",
            "-t",
            "golubev_plus",
            "-f",
            "head-shot",
            "-s",
            "160x90",
            "--supersample",
            "1",
            "-o",
            files[0],
            "--samples",
            files[1],
            "--contrast",
            files[2],
        ],
        env={**os.environ, "PYOPENGL_PLATFORM": platform},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stderr
    return files


@pytest.fixture(scope="module")
def by_egl(tmp_path_factory):
    return rendered("egl", tmp_path_factory.mktemp("render") / "egl")


def test_command_line_writes_image_samples_and_contrast(by_egl):
    image, samples, contrast = by_egl
    assert Image.open(image).size == Image.open(contrast).size == (160, 90)
    samples = np.load(samples)
    assert samples.shape == (90, 160) and set(np.unique(samples)) == {0, 12, 22}


@pytest.mark.skipif(
    find_library("OSMesa") is None,
    reason="this distribution has no libosmesa6 (Mesa dropped it in 25.1)",
)
def test_egl_and_osmesa_give_the_same_bytes(by_egl, tmp_path):
    for one, other in zip(by_egl, rendered("osmesa", tmp_path / "osmesa"), strict=True):
        assert one.read_bytes() == other.read_bytes(), one.name


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["-t", "golub", "-o", "a.png"], "no technique 'golub'"),
        (["-t", "none", "-f", "far", "-o", "a.png"], "no framing 'far'"),
        (["-t", "none", "-s", "big", "-o", "a.png"], "expected WIDTHxHEIGHT"),
        (["-t", "none", "-o", "a.jpg"], "expected a file name that ends in .png"),
        (["-t", "none", "-o", "nowhere/a.png"], "there is no folder"),
        (["-t", "none", "-o", "a.png", "--contrast", "c.png"], "measures no contrast"),
        (["-t", "golubev", "-p", "samples=0", "-o", "a.png"], "golubev.samples is 0"),
        (["-t", "golubev", "-p", "samples", "-o", "a.png"], "expected NAME=VALUE"),
        (["-t", "none", "--head", "gone.obj", "-o", "a.png"], "gone.obj"),
        (["-t", "none"], "--out"),
    ],
)
def test_command_line_refuses_in_one_line(arguments, words, capsys, tmp_path, monkeypatch):
    from app.cli import main

    monkeypatch.chdir(tmp_path)
    assert main(["render", *arguments]) == 2
    error = capsys.readouterr().err
    assert words in error and error.count("\n") == 1 and "Traceback" not in error
    assert not list(tmp_path.iterdir())


def test_times_are_taken_of_techniques(frames, techniques):
    timed = {name: techniques[name] for name in ("none", "golubev_plus", "deon_luebke")}
    spent = frames["head-shot"].time(timed, 2)
    assert spent.keys() == timed.keys()
    assert all(
        times.shape == (2, 2) and (times[:, 0] > 0).all() and (times >= 0).all()
        for times in spent.values()
    )


def test_sizes_out_of_range_are_refused(model, stand):
    for size, supersample in (((8, 90), 1), ((9000, 90), 1), ((5000, 90), 2), ((160, 90), 7)):
        with pytest.raises(InputError, match="expected"):
            renderer.Renderer(stand(model), size=size, supersample=supersample)


def test_a_program_wants_exactly_its_uniforms(drawing):
    drawing.context.make_current()
    program: Program = drawing.program("techniques/none.glsl")
    with pytest.raises(ValueError, match="techniques/none.glsl: uniforms not given: irradiance"):
        program.use()
    with pytest.raises(ValueError, match="no such uniforms: colour"):
        program.use(irradiance=None, colour=1)

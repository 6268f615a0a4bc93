"""Multipole splats: tables against the multipole, a sheet's two faces, sampling by lamps."""

from dataclasses import replace

import numpy as np
import pytest

import renderer
from renderer.errors import InputError
from renderer.optics import fits, montecarlo, slabs
from renderer.optics.fits import DipoleFit
from renderer.optics.fresnel import extrapolation
from renderer.optics.layered import Layered
from renderer.optics.medium import MEDIA, Layer, Stack
from renderer.optics.multipole import Multipole
from renderer.optics.transmittance import part
from renderer.scene.harmonics import COSINE, basis, project
from renderer.scene.lights import DistantLight, PointLight
from renderer.scene.maps import directions
from renderer.techniques.points import blurred
from renderer.techniques.samples import Body
from tests.renderer.slab import BALL, drawn, frame_of_ball, lit, places
from tests.renderer.test_splat_dipole import behind_a_sheet, run
from tests.renderer.test_techniques import SKIN

MARBLE = MEDIA["marble"]
#: Jensen's dipole of marble, whose multipole is Donner and Jensen's.
POLES = DipoleFit(
    MARBLE.mfp, MARBLE.mfp * (1 + 4 / 3 * extrapolation(1.5)), MARBLE.sigma_tr, np.zeros(3)
)
CURVE = POLES.curve()
BY_PROFILES = {"through": "profiles", "thinnest": 1.2}


def of_marble(inputs):
    """Inputs whose medium is marble with the dipole's own curve: without a simulation."""
    return replace(inputs, curve=CURVE, room=replace(inputs.room, value="marble"))


def scattered(frame, technique, inputs=None):
    with technique.scatter(inputs or frame.inputs(None)).target as target:
        return target.textures[0].read()[..., :3].copy()


@pytest.mark.parametrize(
    ("thickness_mm", "R", "T", "by_photons"),
    [(1.0, 0.52906, 0.44990, (0.5114, 0.4691)), (4.0, 0.7243, 0.1962, (0.7303, 0.1946))],
)
def test_a_fitted_slab_is_the_multipole(thickness_mm, R, T, by_photons):
    """Green of marble, computed beforehand in two other ways: the image sums of Donner and Jensen
    2005, and Monte Carlo of a slab with an index of 1.5; and this project's own multipole and
    Monte Carlo."""
    whole = 0.79093  # Jensen's closed form for green
    got_R, got_T = slabs.fitted(POLES, 1.2).totals(np.array([thickness_mm]))
    assert got_R[0, 1] * whole == pytest.approx(R, abs=2e-4)
    assert got_T[0, 1] * whole == pytest.approx(T, abs=2e-4)
    own = Multipole(Stack.of(MARBLE, thickness_mm)).totals()
    thick = Multipole(Stack.of(MARBLE)).totals()[0]
    np.testing.assert_allclose(got_R[0] * thick, own[0], rtol=1e-6)
    np.testing.assert_allclose(got_T[0] * thick, own[1], rtol=1e-6)
    np.testing.assert_allclose([R, T], by_photons, rtol=0.045)
    result = montecarlo.simulate(
        montecarlo.layers_of(Stack.of(MARBLE, thickness_mm), 1), 20_000, 5, 1.0, 1.0
    )
    entered = 1 - result.specular
    assert result.transmittance / entered == pytest.approx(T, rel=0.06)
    assert result.diffuse_reflectance / entered == pytest.approx(R, rel=0.06)


@pytest.mark.parametrize("nearest_mm", [(0.0, 0.0), (1.2, 1.5)])
def test_densities_hold_the_totals(nearest_mm):
    """Integrals over the plane, by both ways, which agree where there is one layer."""
    d, r = np.array([1.5, 5.0]), np.geomspace(1e-3, 250.0, 900)
    fitted = slabs.fitted(POLES, 1.2, nearest_mm)
    both = fitted.densities(d, r)
    for density, total in zip(both, fitted.totals(d), strict=True):
        got = np.trapezoid(density * 2 * np.pi * r[None, :, None], r, axis=1)
        np.testing.assert_allclose(got, total, rtol=5e-3)
    near = r < 20.0
    layers = slabs.layered(Stack.of(MARBLE), 1.2, nearest_mm).densities(d, r[near])
    for one, other in zip(both, layers, strict=True):
        np.testing.assert_allclose(one[:, near], other, rtol=0.02, atol=2e-4)


def test_coatings_are_combined_profiles_on_both_faces():
    coated = Stack((Layer(MEDIA["wholemilk"], 1.0), Layer(MARBLE)))
    d = np.array([6.0, 10.0])
    R, T = slabs.layered(coated, 1.2).totals(d)
    whole = Layered(coated).totals()[0]
    for k, thickness in enumerate(d):
        own = Layered(part(coated, thickness)).totals()
        np.testing.assert_allclose(R[k] * whole, own[0], rtol=1e-9)
        np.testing.assert_allclose(T[k] * whole, own[1], rtol=1e-9)
    bare = slabs.layered(Stack.of(MARBLE), 1.2).totals(d)
    assert (bare[1] - T > 0).all()


def test_of_an_endless_part_it_is_the_dipole():
    dipole, multipole = (
        renderer.make(name, {"spacing_mm": 0.5}) for name in ("splat_dipole", "splat_multipole")
    )
    one, other = (t.tables(SKIN, None, 0.5) for t in (dipole, multipole))
    assert one.reach_mm == other.reach_mm
    inner = slice(0, 400)
    np.testing.assert_allclose(other.near[-1, inner], one.near[0, inner], rtol=0.02, atol=1e-5)
    np.testing.assert_allclose(other.near_total[-1], 1, atol=5e-3)
    assert (other.far[-1] == 0).all() and (np.diff(other.near_total, axis=0) >= 0).all()


@pytest.mark.parametrize("samples", ["surface", "lights"])
@pytest.mark.parametrize("profiles", ["fitted", "layers"])
def test_a_sheets_faces_send_what_the_multipole_says(samples, profiles):
    """R + T of 2 mm of marble under a lamp, by what the two faces of a rendered sheet send."""
    parameters = {**BY_PROFILES, "samples": samples, "profiles": profiles, "spacing_mm": 0.6}
    technique = renderer.make("splat_multipole", {**parameters, "share": 0.999})
    own = Multipole(Stack.of(MARBLE, 2.0)).totals()
    thick = Multipole(Stack.of(MARBLE)).totals()[0]
    if profiles == "fitted":
        totals = slabs.fitted(fits.dipole(CURVE), 1.2).totals(np.array([2.0]))
        np.testing.assert_allclose(totals[0][0] * thick, own[0], rtol=0.04)
        own, thick = [t[0] for t in totals], 1.0
    for towards, wanted in ((1.0, own[0]), (-1.0, own[1])):
        table = behind_a_sheet(2.0)
        table["objects"]["sheet"]["size_mm"] = [44.0, 44.0]
        table["lights"]["lamp"]["direction"] = [0.0, 0.0, towards]
        table["camera"]["height_mm"] = 10.0
        with drawn(table, (24, 24)) as frame:
            got = scattered(frame, technique, of_marble(frame.inputs(None)))
        np.testing.assert_allclose(got.mean(axis=(0, 1)), wanted / thick, rtol=0.03)


def test_the_documents_distance_loses_most_of_what_comes_through():
    """T by the distance itself instead of that along the face (eq. 5.2): 2 mm of marble lose half
    of it."""
    got = []
    for distance in ("along", "published"):
        technique = renderer.make("splat_multipole", {**BY_PROFILES, "distance": distance})
        with drawn(behind_a_sheet(2.0), (24, 24)) as frame:
            light = scattered(frame, technique, of_marble(frame.inputs(None)))
        got.append(light.mean(axis=(0, 1)))
    assert (got[1] < 0.55 * got[0]).all()


def test_the_edges_of_a_thin_slat_lit_from_behind_are_even():
    """1 mm of marble, points 0.7 mm apart: along its edges, where single points are missing, light
    deviates by less than 7 % of its mean (by 14 % with half of the blur)."""
    table = behind_a_sheet(1.0)
    table["objects"]["sheet"]["size_mm"] = [8.0, 40.0]
    with drawn(table, (28, 48)) as frame:
        got = scattered(frame, renderer.make("splat_multipole"), of_marble(frame.inputs(None)))
    columns = np.flatnonzero((got[..., 1] > 0).all(axis=0))
    for column in (columns[0], columns[-1]):
        light = got[:, column].mean(axis=1)
        assert light.std() < 0.07 * light.mean()


def test_constant_light_stays_constant():
    """On a thick ball: exactly where it is normalised; 2 % beside the share of a splat by the sum
    (the ball's curvature takes the rest, (1 - n . n') / 2 of which is of the far face)."""
    light = np.array([2.0, 1.0, 0.5])
    with frame_of_ball((64, 48)) as ball:
        _, scatters = places(ball)
        for weights, tolerance in (("normalised", 2e-3), ("published", 0.02)):
            technique = renderer.make("splat_multipole", {"spacing_mm": 1.5, "weights": weights})
            got, count = run(technique, ball, lambda p: np.broadcast_to(light, p.shape))
            mean = got[scatters].mean(axis=0) / light
            wanted = 1 if weights == "normalised" else technique.share
            np.testing.assert_allclose(mean, wanted, atol=tolerance)
            assert ((count > 0) == scatters).all()


def spot(p):
    """A Gaussian spot of light of 4 mm on the front of a slab of 30 mm."""
    d2 = (p[..., 0] - 2.0) ** 2 + p[..., 1] ** 2
    return np.repeat(np.exp(-d2 / 8.0)[..., None] * (p[..., 2:3] > 14.9), 3, axis=-1)


def test_many_points_converge_to_the_integral_over_the_surface():
    """R of the distance times E, summed over a grid of 0.2 mm in the plane that no renderer takes
    part in: rms of all pixels, of the brightest's light."""
    table = behind_a_sheet(30.0)
    front = {"framing": "sheet", "height_mm": 24.0, "target_mm": [0.0, 0.0, 15.0]}
    table["camera"] = {**front, "angle": "front"}
    grid = np.stack(np.meshgrid(np.arange(-11.9, 16, 0.2), np.arange(-13.9, 14, 0.2)), axis=-1)
    light = spot(np.dstack([grid, np.full(grid.shape[:2], 15.0)]))[..., 0]
    near = np.linspace(0, 60, 6000)
    density = blurred(fits.dipole(CURVE), np.maximum(0.5 - fits.dipole(CURVE).real_mm, 0))
    density = density.density(near)
    misses = {}
    with drawn(table, (32, 32)) as frame:
        at = places(frame)[0][2::4, 2::4].reshape(-1, 3)
        r = np.linalg.norm(grid - at[:, None, None, :2], axis=-1)
        wanted = [(np.interp(r, near, d) * light).sum(axis=(1, 2)) * 0.04 for d in density.T]
        wanted = np.stack(wanted, axis=-1)
        given = of_marble(lit(frame, spot))
        for weights in ("normalised", "published"):
            for spacing in (2.0, 1.0, 0.5):
                sampling = {"spacing_mm": spacing, "weights": weights, "blur": 0.5 / spacing}
                parameters = {**BY_PROFILES, **sampling, "share": 0.999}
                technique = renderer.make("splat_multipole", parameters)
                got = scattered(frame, technique, given)[2::4, 2::4].reshape(-1, 3)
                rms = np.sqrt(((got - wanted) ** 2).mean(axis=0)) / wanted.max()
                misses[weights, spacing] = rms.max()
    for weights, bound in (("normalised", 0.003), ("published", 0.006)):
        few, more, many = (misses[weights, s] for s in (2.0, 1.0, 0.5))
        assert many < 0.5 * more < 0.25 * few and many < bound, misses


def test_light_stays_within_an_object_unless_it_is_told_to_cross():
    """Two slabs of one medium 0.2 mm apart, one of them lit."""
    table = behind_a_sheet(2.0)
    slab = {"shape": "slab", "size_mm": [8.0, 20.0, 8.0], "material": "sheet"}
    table["objects"] = {
        "left": {**slab, "position_mm": [-4.1, 0.0, 0.0]},
        "right": {**slab, "position_mm": [4.1, 0.0, 0.0]},
    }

    def left(p):
        return np.repeat((p[..., :1] < 0).astype(float), 3, axis=-1)

    got = {}
    with drawn(table, (32, 32)) as frame:
        at, _ = places(frame)
        right = (at[..., 0] > 0.3) & (at[..., 0] < 1.5) & (np.abs(at[..., 1]) < 6)
        for stays in ("object", "medium"):
            technique = renderer.make("splat_multipole", {"spacing_mm": 1.0, "stays": stays})
            got[stays] = scattered(frame, technique, lit(frame, left))[right][:, 0].mean()
    assert got["object"] == 0 and got["medium"] > 0.05


def test_lamps_and_the_environment_add_up():
    """Two lamps and an ambient light together are the sum of each alone, by grids; and what points
    over the surface say, to what the two ways of sampling leave."""
    lamps = {
        "one": {"direction": [0.5, 0.4, 0.8], "irradiance": [1.0, 0.5, 0.2]},
        "two": {"kind": "point", "position_mm": [-200.0, 50.0, 150.0], "irradiance": [0.05] * 3},
    }
    dark, sky = {"ambient": [0.0] * 3}, {"ambient": [0.2] * 3}
    cases = [({"one": lamps["one"]}, dark), ({"two": lamps["two"]}, dark), ({}, sky), (lamps, sky)]
    by_grids = renderer.make("splat_multipole", {"spacing_mm": 1.5, "samples": "lights"})
    got = []
    for lights, environment in cases:
        table = {**BALL, "lights": lights, "environment": environment}
        with drawn(table) as frame:
            got.append(scattered(frame, by_grids))
            if len(lights) == 2:
                over = scattered(frame, renderer.make("splat_multipole", {"spacing_mm": 1.5}))
                _, scatters = places(frame)
    np.testing.assert_allclose(got[0] + got[1] + got[2], got[3], atol=2e-3)
    miss = (got[3] - over)[scatters]
    assert np.abs(miss.mean(axis=0)).max() < 0.02 and np.sqrt((miss**2).mean(axis=0))[0] < 0.07


def test_a_mediums_lengths_and_thicknesses_are_scaled_at_run_time():
    """Half as thick a sheet of a medium of half its lengths sends the same through; thickness_scale
    makes 2 mm act as 4, or everything as the thinnest part."""
    cases = {
        "whole": (4.0, {}),
        "smaller": (2.0, {"medium_scale": 0.5}),
        "stretched": (2.0, {"thickness_scale": 2.0}),
        "thinnest": (4.0, {"thickness_scale": 0.0}),
    }
    got = {}
    for name, (thickness, parameters) in cases.items():
        technique = renderer.make("splat_multipole", {**BY_PROFILES, **parameters})
        with drawn(behind_a_sheet(thickness), (24, 24)) as frame:
            light = scattered(frame, technique, of_marble(frame.inputs(None)))
        got[name] = light.mean(axis=(0, 1))
    np.testing.assert_allclose(got["smaller"], got["whole"], rtol=0.08)
    np.testing.assert_allclose(got["stretched"], got["whole"], rtol=0.1)
    assert (got["thinnest"] > 2 * got["whole"]).all() and np.isfinite(got["thinnest"]).all()


def test_nine_harmonics_give_points_the_environments_light():
    """A wide panel and an ambient light on a ball: the irradiance of its nine coefficients by the
    normal, which a thin blur leaves as it is."""
    panel = {"direction": [0.3, 0.9, 0.2], "sharpness": 2.0, "radiance": [1.0, 0.8, 0.6]}
    table = {
        **BALL,
        "lights": {},
        "environment": {"ambient": [0.1, 0.1, 0.1], "panels": {"sky": panel}},
    }
    technique = renderer.make("splat_multipole", {"spacing_mm": 1.5, "even": "harmonics"})
    with drawn(table) as frame:
        got = scattered(frame, technique)
        at, scatters = places(frame)
        surroundings = frame.renderer.surroundings
    towards = directions(64)
    radiance = surroundings.radiance(towards.reshape(-1, 3), 4096.0).reshape(64, 128, 3)
    normals = at / np.linalg.norm(at, axis=-1, keepdims=True)
    wanted = (basis(normals) * COSINE) @ project(radiance)
    np.testing.assert_allclose(got[scatters], wanted[scatters], rtol=0.02)


def test_a_grids_footprints_cover_what_a_lamp_sees():
    """A distant lamp sees a ball's disc, pi r^2, face-on; a near one the cap within its horizon,
    2 pi r^2 (1 - r / d), the cosine's limit aside."""
    with frame_of_ball((16, 16)) as frame:
        body = Body(frame.inputs(None).room.surfaces, 0)
    options = (1.0, (0, 0), 0.0, False, False, "here")
    far = body.from_lamp(DistantLight(direction=(0.0, 0.6, 0.8)), *options)
    n = body.mesh.normals[far.triangles]
    cosine = np.maximum(n @ [0.0, 0.6, 0.8], 0.05)
    assert (far.area_mm2 * cosine).sum() == pytest.approx(np.pi * 40**2, rel=0.02)
    near = body.from_lamp(PointLight(position_mm=(0.0, 0.0, 100.0)), *options)
    assert near.area_mm2.sum() == pytest.approx(2 * np.pi * 40**2 * (1 - 40 / 100), rel=0.04)
    deep = body.over_surface(2.0, 0, "here").depth_mm
    assert np.median(deep) == pytest.approx(80.0, rel=0.01)
    paper = body.from_lamp(
        DistantLight(direction=(0.0, 0.6, 0.8)), 1.0, (75, 52), 0.0, True, True, "here"
    )
    assert paper.area_mm2[0] == pytest.approx(2 * 80**2 / (75 * 52), rel=0.01)
    assert len(paper.triangles) < 75 * 52


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"depth": "light"}, "splat_multipole.depth is 'light' with samples 'surface'"),
        ({"grid": (75, 0)}, "splat_multipole.grid is (75, 0)"),
        ({"thinnest": 0.5}, "splat_multipole.thinnest is 0.5"),
    ],
)
def test_parameters_that_do_not_go_together_are_refused(parameters, words):
    with pytest.raises(InputError) as caught:
        renderer.make("splat_multipole", parameters)
    assert words in str(caught.value)


def test_layers_need_coefficients():
    technique = renderer.make("splat_multipole", {"profiles": "layers"})
    with pytest.raises(InputError, match="'layers' for 'deon_luebke', which is known as a curve"):
        technique.tables(SKIN, "deon_luebke", 0.7)

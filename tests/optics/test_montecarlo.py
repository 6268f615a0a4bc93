"""Monte Carlo against exact and published numbers, and the promises of its docstrings."""

import itertools
import math

import numba
import numpy as np
import pytest
from scipy import integrate, stats

from renderer.errors import InputError
from renderer.optics import chandrasekhar, fresnel, montecarlo, walk
from renderer.optics.montecarlo import Layer, simulate

HULST = [Layer(1, 1, 9, 0.75, 0.2)]  # mu_a 10/cm, mu_s 90/cm, 0.02 cm


@pytest.fixture(autouse=True)
def own_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("SUBDERMAL_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "montecarlo"


def within(value, error, expected, sigmas=3.0, slack=0.0):
    """Within so many standard errors, and the error is small enough to mean something."""
    assert np.all(np.abs(np.asarray(value) - expected) <= sigmas * np.asarray(error) + slack), (
        value,
        error,
        expected,
    )


# Published cases.


def test_van_de_hulst_slab():
    """van de Hulst 1980, "Multiple light scattering", vol.

    2, p. 435, table 35: totals, and radiances of the scattered light.
    """
    result = simulate(HULST, 2_000_000, seed=1)
    assert result.diffuse_reflectance_error < 3e-4 and result.transmittance_error < 3e-4
    within(result.diffuse_reflectance, result.diffuse_reflectance_error, 0.09739)
    within(result.transmittance, result.transmittance_error, 0.66096)
    within(result.ballistic, result.ballistic_error, math.exp(-2))
    mu = np.array([0.1, 0.3, 0.5, 0.7, 0.9])
    at = np.searchsorted(result.angle_edges, np.arccos(mu)) - 1
    middle = np.cos(
        result.angle_edges[at] / 2 + result.angle_edges[at + 1] / 2
    )  # the table in between, by a smooth curve through I(mu)
    for curve, error, table in (
        (
            result.R_angular,
            result.R_angular_error,
            [0.10641, 0.13304, 0.13856, 0.11956, 0.09411, 0.07132, 0.06180],
        ),
        (
            result.T_angular,
            result.T_angular_error,
            [0.11811, 0.16486, 0.22473, 0.27785, 0.36889, 0.72155, 2.40270],
        ),
    ):
        radiance = np.exp(np.interp(middle, [0, *mu, 1], np.log(table)))
        assert (error[at] < 0.1 * curve[at]).all()
        within(curve[at], error[at], radiance * middle / np.pi)


def test_giovanelli_half_space():
    """Giovanelli 1955, as in the MCML manual: n 1.5, albedo 0.9, isotropic: 0.2600 with the
    mirrored 0.04.
    """
    result = simulate([Layer(1.5, 1, 9)], 1_000_000, seed=2)
    assert (
        result.specular == pytest.approx(0.04, abs=1e-12)
        and result.diffuse_reflectance_error < 4e-4
    )
    within(result.specular + result.diffuse_reflectance, result.diffuse_reflectance_error, 0.2600)


def test_three_layers():
    """The MCML manual's sample: n 1.37, mu_a and mu_s in 1/cm and d in cm of (1, 100, .9, .1), (1,
    10, 0, .1), (2, 10, .7, .2). Its numbers come with no errors; they have three or four digits of
    its own noise.
    """
    layers = [Layer(1.37, 0.1, 10, 0.9, 1), Layer(1.37, 0.1, 1, 0, 1), Layer(1.37, 0.2, 1, 0.7, 2)]
    result = simulate(layers, 200_000, seed=3)
    assert result.specular == pytest.approx(0.02437, abs=1e-5)
    within(result.diffuse_reflectance, result.diffuse_reflectance_error, 0.2375, slack=0.001)
    within(result.absorbed, result.absorbed_error, 0.6416, slack=0.0015)
    within(result.transmittance, result.transmittance_error, 0.0965, slack=0.0005)


@pytest.mark.parametrize(
    ("eta", "alpha", "total", "multiple"),
    [
        (1, 0.5, 0.1152, 0.0385),
        (1, 0.8, 0.2857, 0.1626),
        (1, 0.9, 0.4153, 0.2769),
        (1, 0.99, 0.7524, 0.6006),
        (1.3, 0.8, 0.1813, 0.1207),
        (1.3, 0.9, 0.2909, 0.2225),
        (1.3, 0.99, 0.6568, 0.5810),
        (1.4, 0.5, 0.0538, 0.0222),
        (1.4, 0.8, 0.1573, 0.1068),
        (1.4, 0.9, 0.2579, 0.2008),
        (1.4, 0.95, 0.3695, 0.3091),
        (1.4, 0.99, 0.6210, 0.5585),
        (1.4, 0.999, 0.8536, 0.7907),
        (1.5, 0.8, 0.1374, 0.0947),
        (1.5, 0.99, 0.5846, 0.5305),
    ],
)
def test_totals_of_an_independent_program(eta, alpha, total, multiple):
    """Diffuse reflectance per entered light of isotropic half-spaces, all and multiply scattered,
    from another Monte Carlo program whose noise is up to 0.001.
    """
    result = simulate([Layer(eta, 1 - alpha, alpha)], 30_000 if alpha == 0.999 else 100_000, seed=4)
    entered = 1 - result.specular
    within(
        result.diffuse_reflectance / entered,
        result.diffuse_reflectance_error / entered,
        total,
        slack=0.001,
    )
    within(
        result.multiple_reflectance / entered,
        result.multiple_reflectance_error / entered,
        multiple,
        slack=0.001,
    )


# Exact results.


@pytest.mark.parametrize("alpha", [0.01, 0.3, 0.8, 0.97])
def test_half_space_is_chandrasekhars(alpha):
    beam = simulate([Layer(1, 1 - alpha, alpha)], 400_000, seed=5)
    within(
        beam.diffuse_reflectance,
        beam.diffuse_reflectance_error,
        chandrasekhar.searchlight_albedo(alpha),
    )
    within(beam.single_reflectance, beam.single_reflectance_error, alpha / 2 * (1 - math.log(2)))
    diffuse = simulate([Layer(1, 1 - alpha, alpha)], 400_000, seed=6, illumination="diffuse")
    within(
        diffuse.diffuse_reflectance,
        diffuse.diffuse_reflectance_error,
        chandrasekhar.diffuse_albedo(alpha),
    )


def test_single_scattering_by_radius():
    """R_1(r) = int mu_s e^-z p e^-d (z / d) / d^2 dz with d^2 = r^2 + z^2 and Henyey-Greenstein's
    p, averaged over rings.
    """
    g, edges = 0.4, np.array([0, 0.1, 0.3, 1, 2, 4])
    result = simulate([Layer(1, 0.3, 0.7, g)], 2_000_000, seed=7, bins=edges)

    def share(z, r):
        d = math.hypot(r, z)
        p = (
            (1 - g * g) / (1 + g * g + 2 * g * z / d) ** 1.5 / (4 * math.pi)
        )  # turned back: cosine -z / d
        return 0.7 * math.exp(-z - d) * p * z / d**3 * 2 * math.pi * r

    exact = [
        integrate.dblquad(share, low, high, 0, np.inf)[0] for low, high in itertools.pairwise(edges)
    ]
    within(result.R_single * result.area_mm2, result.R_single_error * result.area_mm2, exact)


def test_clear_slab_mirrors_back_and_forth():
    result = simulate([Layer(1.5, 0, 0, 0, 2)], 200_000, seed=8)
    within(result.specular, result.specular_error, 2 * 0.04 / 1.04)
    assert result.diffuse_reflectance == result.absorbed == 0
    assert result.transmittance == result.ballistic


def test_pure_absorber_is_beers():
    result = simulate([Layer(1, 0.5, 0, 0, 1), Layer(1, 2, 0, 0, 0.25)], 300_000, seed=9)
    within(result.transmittance, result.transmittance_error, math.exp(-1))
    within(
        result.absorbed_by_layer,
        result.absorbed_by_layer_error,
        [1 - math.exp(-0.5), math.exp(-0.5) - math.exp(-1)],
    )


def test_diffuse_light_is_mirrored_by_the_diffuse_fresnel_reflectance():
    result = simulate([Layer(1.4, 5, 0)], 200_000, seed=10, illumination="diffuse")
    cosines = np.linspace(0, 1, 20001)[1:]
    external = 2 * integrate.trapezoid(fresnel.reflectance(cosines, 1 / 1.4) * cosines, cosines)
    within(result.specular, result.specular_error, external, slack=1e-6)
    assert result.specular_error < 5e-4


def test_total_reflection_from_a_denser_outside():
    """Diffuse light in glass, n 1.5, on air: all beyond the critical angle is mirrored; reciprocity
    gives 1 - (1 - F_in) / 1.5^2.
    """
    result = simulate([Layer(1, 1, 0)], 300_000, seed=11, n_above=1.5, illumination="diffuse")
    cosines = np.linspace(0, 1, 20001)[1:]
    outside = 2 * integrate.trapezoid(fresnel.reflectance(cosines, 1 / 1.5) * cosines, cosines)
    within(result.specular, result.specular_error, 1 - (1 - outside) / 1.5**2, slack=1e-5)


def test_roulette_is_fair():
    """Forward scattering alone is Beer's law; nearly all of this light has been through roulette,
    for weights below 1e-4.
    """
    result = simulate([Layer(1, 10, 90, 0.999999, 1)], 300_000, seed=24)
    assert result.transmittance_error < 0.006 * result.transmittance
    within(
        result.transmittance, result.transmittance_error, math.exp(-10), slack=1e-3 * math.exp(-10)
    )


def test_light_is_bent_between_layers():
    """A thin sheet scatters light into clear glass 1 mm thick: it leaves at r = tan(theta_2),
    sin(theta_2) = sin(theta_1) / 1.5.
    """
    critical, half = (
        math.tan(math.asin(sine / 1.5)) for sine in (1, math.sqrt(0.75))
    )  # grazing, and theta_1 = 60 degrees
    result = simulate(
        [Layer(1, 0, 100, 0, 1e-3), Layer(1.5, d=1)],
        400_000,
        seed=25,
        n_below=1.5,
        bins=[0, half, critical * 1.01, 9],
    )
    inner, outer, beyond = result.T_single * result.area_mm2
    assert beyond < 0.005 * inner and outer > 0.1 * inner  # a few run along the sheet first
    # Scattered at depth t of the sheet, tau = 0.1: int e^(-t) / 2 int_(mu) e^(-(tau - t) / mu) (1 -
    # F(mu)) dmu dt over mu > 1/2.
    mu, t = np.linspace(0.5, 1, 2001)[:-1], np.linspace(0, 0.1, 401)
    entered = 1 - fresnel.reflectance(mu, 1 / 1.5)
    exact = integrate.trapezoid(
        np.exp(-t)
        * integrate.trapezoid(np.exp(-(0.1 - t[:, None]) / mu) * entered, mu, axis=1)
        / 2,
        t,
    )
    # Some light that was mirrored at the glass before is scattered once, too: at most 4 % of 5 %.
    within(inner, result.T_single_error[0] * result.area_mm2[0], exact, slack=0.05 * exact)


def test_conservative_slab_returns_everything():
    result = simulate([Layer(1.4, 0, 5, 0.8, 2)], 50_000, seed=12, n_below=1.33)
    assert result.absorbed == pytest.approx(0, abs=5 * result.absorbed_error + 1e-12)
    assert result.specular + result.diffuse_reflectance + result.transmittance == pytest.approx(
        1, abs=1e-11
    )


# Properties.

STACKS = {
    "matched": {"layers": HULST},
    "mismatched": {"layers": [Layer(1.5, 0.1, 2, 0.9, 1)], "n_above": 1.2, "n_below": 1.9},
    "diffuse on a dense outside": {
        "layers": [Layer(1.1, 0.2, 3)],
        "n_above": 1.6,
        "illumination": "diffuse",
    },
    "glass above and within": {
        "layers": [
            Layer(1.5, d=1),
            Layer(1.3, 0.05, 4, 0.7, 1),
            Layer(1.5, d=0.5),
            Layer(1.4, 0.5, 2, -0.5),
        ]
    },
    "grazing": {"layers": [Layer(1, 1e-3, 1, 0.99, 30)]},
}


@pytest.mark.parametrize("stack", STACKS)
def test_no_energy_is_lost_and_curves_hold_it_all(stack):
    result = simulate(**STACKS[stack], photons=40_000, seed=13, r_max_mm=1.5, bins=17)
    assert (
        result.specular + result.diffuse_reflectance + result.transmittance + result.absorbed
        == pytest.approx(1, abs=1e-12)
    )
    assert result.absorbed == pytest.approx(result.absorbed_by_layer.sum(), abs=1e-12)
    scattered = result.transmittance - result.ballistic
    for total, curve, beyond, angular in (
        (result.diffuse_reflectance, result.R, result.R_beyond, result.R_angular),
        (scattered, result.T, result.T_beyond, result.T_angular),
    ):
        assert (curve * result.area_mm2).sum() + beyond == pytest.approx(total, abs=1e-13)
        assert (angular * result.solid_angle).sum() == pytest.approx(total, abs=1e-13)
    assert np.allclose(result.R, result.R_single + result.R_multiple, atol=1e-15)
    assert result.single_transmittance + result.multiple_transmittance == pytest.approx(
        scattered, abs=1e-13
    )


def test_lengths_scale():
    """Twice the millimetres and half the coefficients are the same walk, to the bit."""
    one = simulate([Layer(1.4, 0.5, 4, 0.8, 1)], 20_000, seed=14, r_max_mm=2)
    two = simulate([Layer(1.4, 0.25, 2, 0.8, 2)], 20_000, seed=14, r_max_mm=4)
    assert (
        one.diffuse_reflectance == two.diffuse_reflectance
        and (one.R == 4 * two.R).all()
        and one.absorbed == two.absorbed
    )


def test_a_layer_may_be_cut():
    whole = simulate([Layer(1.4, 0.2, 5, 0.8, 1)], 200_000, seed=15)
    cut = simulate([Layer(1.4, 0.2, 5, 0.8, 0.3), Layer(1.4, 0.2, 5, 0.8, 0.7)], 200_000, seed=16)
    for name in ("diffuse_reflectance", "transmittance", "absorbed", "ballistic"):
        both = math.hypot(getattr(whole, f"{name}_error"), getattr(cut, f"{name}_error"))
        within(getattr(whole, name), both, getattr(cut, name))


def test_standard_errors_are_honest():
    """Over 60 seeds, deviations from the exact value in units of the reported error have variance 1
    (chi squared, 0.1 % tails).
    """
    exact = chandrasekhar.searchlight_albedo(0.9)
    runs = [simulate([Layer(1, 0.1, 0.9)], 6400, seed=seed, cache=False) for seed in range(60)]
    z = np.array(
        [(run.diffuse_reflectance - exact) / run.diffuse_reflectance_error for run in runs]
    )
    assert stats.chi2.ppf(0.0005, 60) < (z**2).sum() < stats.chi2.ppf(0.9995, 60)


def test_photons_that_do_not_divide_into_batches():
    result = simulate([Layer(1, 1, 0)], 100, seed=17)
    assert result.absorbed == pytest.approx(
        1, abs=1e-13
    ) and result.absorbed_error == pytest.approx(0, abs=1e-13)


# Sampling.


@numba.njit
def draws(count, state):
    lengths, circle = np.empty(count), np.empty((count, 2))
    for i in range(count):
        state, lengths[i] = walk._exponential(state)
        state, bits = walk._bits(state)
        circle[i] = walk._azimuth(bits)
    return lengths, circle


def test_path_lengths_and_azimuths():
    lengths, circle = draws(200_000, np.uint64(5))
    assert stats.kstest(lengths, "expon").pvalue > 1e-3
    # The tail of the ziggurat, too: the share beyond it, and the law within.
    beyond = lengths[lengths > walk.TAIL] - walk.TAIL
    assert (
        abs(len(beyond) - 200_000 * math.exp(-walk.TAIL))
        < 4 * math.sqrt(200_000 * math.exp(-walk.TAIL))
        and len(beyond) > 50
    )
    assert stats.kstest(beyond, "expon").pvalue > 1e-3
    assert np.abs((circle**2).sum(1) - 1).max() < 1e-13
    assert (
        stats.kstest(np.arctan2(circle[:, 1], circle[:, 0]), "uniform", (-np.pi, 2 * np.pi)).pvalue
        > 1e-3
    )


def test_the_ziggurat_closes():
    assert walk.STRIPS[256] == 0 and (np.diff(walk.STRIPS) < 0).all()
    assert walk.STRIPS[255] * (1 - walk.HEIGHTS[255]) == pytest.approx(
        (walk.TAIL + 1) * math.exp(-walk.TAIL), rel=1e-11
    )


@numba.njit
def splitmix(state):
    return walk._bits(state)


def test_splitmix_is_steeles():
    """The generator's published first outputs for the seed 1234567."""
    state, draws = np.uint64(1234567), []
    for _ in range(3):
        state, bits = splitmix(np.uint64(state))
        draws.append(int(bits))
    assert draws == [6457827717110365317, 3203168211198807973, 9817491932198370423]


# Runs: threads, the cache, interruption.


def sums(result):
    return result.tally.sums


def test_threads_do_not_matter():
    one, three = (
        simulate(HULST, 30_001, seed=18, cache=False, threads=threads) for threads in (1, 3)
    )
    assert (sums(one) == sums(three)).all()


def test_seeds_do():
    assert (
        simulate(HULST, 6400, seed=1).diffuse_reflectance
        != simulate(HULST, 6400, seed=2).diffuse_reflectance
    )


def test_results_are_kept(own_cache, monkeypatch):
    first = simulate(HULST, 6400, seed=19)
    assert len(list(own_cache.iterdir())) == 1
    monkeypatch.setattr(montecarlo.Run, "go", lambda *_: pytest.fail("walked again"))
    assert (sums(simulate(HULST, 6400, seed=19)) == sums(first)).all()


def test_more_photons_go_on_from_fewer(monkeypatch):
    fresh = simulate(HULST, 20_000, seed=20, cache=False)
    simulate(HULST, 5_000, seed=20)
    begun = []
    monkeypatch.setattr(
        montecarlo.Run,
        "go",
        lambda run, *rest, go=montecarlo.Run.go: (begun.append(run.done.sum()), go(run, *rest)),
    )
    assert (sums(simulate(HULST, 20_000, seed=20)) == sums(fresh)).all() and begun == [5_000]


def test_fewer_photons_do_not_take_more():
    few = simulate(HULST, 5_000, seed=21, cache=False)
    simulate(HULST, 20_000, seed=21)
    assert (sums(simulate(HULST, 5_000, seed=21)) == sums(few)).all()


def test_interrupted_runs_go_on(own_cache, monkeypatch):
    whole = simulate(HULST, 300_000, seed=22, cache=False)

    def interrupt(waiting, **_):
        """Ctrl-C when a few batches are through."""
        montecarlo.wait_for_three(list(waiting))
        raise KeyboardInterrupt

    def three(futures):
        from concurrent.futures import as_completed

        for _, _ in zip(range(3), as_completed(futures), strict=False):
            pass

    with monkeypatch.context() as patch:
        patch.setattr(montecarlo, "wait_for_three", three, raising=False)
        patch.setattr(montecarlo, "wait", interrupt)
        with pytest.raises(KeyboardInterrupt):
            simulate(HULST, 300_000, seed=22, threads=1)
    (file,) = own_cache.iterdir()
    done = np.load(file)["done"]
    assert 0 < done.sum() < 300_000
    again = simulate(HULST, 300_000, seed=22)
    assert (sums(again) == sums(whole)).all()


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 not a store", b"\x93NUMPY"])
def test_spoilt_stores_do_not_count(own_cache, content):
    good = simulate(HULST, 6400, seed=23)
    (file,) = own_cache.iterdir()
    file.write_bytes(content)
    assert (sums(simulate(HULST, 6400, seed=23)) == sums(good)).all()


def test_whole_numbers_are_numbers(own_cache):
    simulate([Layer(1, 1, 9, 0, 1)], 640, n_above=1)
    simulate([Layer(1.0, np.float64(1), 9.0, 0.0, 1.0)], 640, np.int64(0), n_above=1.0)
    assert len(list(own_cache.iterdir())) == 1


def test_every_parameter_has_results_of_its_own(own_cache):
    base = {"layers": [Layer(1.4, 1, 5, 0.5, 1)], "photons": 640, "seed": 1}
    others = [
        {"seed": 2},
        {"n_above": 1.2},
        {"n_below": 1.2},
        {"illumination": "diffuse"},
        {"r_max_mm": 1.0},
        {"bins": 7},
        {"layers": [Layer(1.4, 1, 5, 0.5, 1.5)]},
    ]
    for changed in [{}, *others]:
        simulate(**{**base, **changed})
    assert len(list(own_cache.iterdir())) == len(others) + 1


# Bad input.


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        ({"n": 0.9}, "n is 0.9"),
        ({"n": math.nan}, "n is nan"),
        ({"n": math.inf}, "n is inf"),
        ({"mu_a": -1}, "mu_a is -1"),
        ({"mu_s": -0.1}, "mu_s is -0.1"),
        ({"mu_s": math.nan}, "mu_s is nan"),
        ({"mu_a": math.inf}, "mu_a is inf"),
        ({"g": 1}, "g is 1"),
        ({"g": -1.0}, "g is -1"),
        ({"g": 1.5}, "g is 1.5"),
        ({"g": math.nan}, "g is nan"),
        ({"d": 0}, "d is 0"),
        ({"d": -1}, "d is -1"),
        ({"d": math.nan}, "d is nan"),
        ({"n": "glass"}, "n is 'glass'"),
        ({"mu_a": True}, "mu_a is True"),
    ],
)
def test_bad_layers(bad, says):
    with pytest.raises(InputError, match=says) as error:
        Layer(**bad)
    assert "expected" in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        ({"layers": []}, "layers is empty"),
        ({"layers": ["skin"]}, "layers is empty or holds something else"),
        ({"layers": [Layer(mu_s=1)]}, "photons would never end"),
        ({"layers": [Layer()]}, "photons would never end"),
        ({"layers": [Layer(mu_a=1), Layer(mu_a=1)]}, "another below it is infinite"),
        ({"photons": 10}, "photons is 10"),
        ({"photons": 1e6}, "photons is 1000000.0"),
        ({"seed": -1}, "seed is -1"),
        ({"seed": 0.5}, "seed is 0.5"),
        ({"n_above": 0.5}, "n_above is 0.5"),
        ({"n_below": math.nan}, "n_below is nan"),
        ({"illumination": "sun"}, "illumination is 'sun'"),
        ({"r_max_mm": 0}, "r_max_mm is 0"),
        ({"r_max_mm": -1}, "r_max_mm is -1"),
        ({"bins": 0}, "bins is 0"),
        ({"bins": 10**9}, "10000 at most"),
        ({"bins": [0, 2, 1]}, "rising"),
        ({"bins": [1, 2]}, "rising"),
        ({"bins": [0, math.nan]}, "rising"),
        ({"bins": [0, 1], "r_max_mm": 1}, "both given"),
        ({"threads": -1}, "threads is -1"),
    ],
)
def test_bad_simulations(own_cache, bad, says):
    with pytest.raises(InputError, match=says) as error:
        simulate(**{"layers": HULST, "photons": 640, **bad})
    assert "\n" not in str(error.value) and not own_cache.exists()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "lacks mu_a or mu_s"),
        ("mu_a=1", "lacks"),
        ("mu_a=1 mu_s=2 x=3", "'x=3'"),
        ("mu_a=1 mu_a=2 mu_s=1", "'mu_a=2'"),
        ("mu_a=much mu_s=1", "mu_a is 'much'"),
        ("mu_a=1 mu_s=nan", "mu_s is nan"),
        ("mu_a mu_s=1", "mu_a is ''"),
        ("mu_t=1", "'mu_t=1'"),
    ],
)
def test_bad_layer_texts(text, says):
    with pytest.raises(InputError, match=says):
        Layer.parse(text)


def test_layer_texts():
    assert Layer.parse("n=1.4 mu_a=1 mu_s=10 g=0.9 d=1") == Layer(1.4, 1, 10, 0.9, 1)
    assert Layer.parse("mu_s=2,mu_a=0.5") == Layer(1, 0.5, 2)

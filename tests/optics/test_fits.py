"""Sums of Gaussians, separable kernels, transmittance by thickness."""

import numpy as np
import pytest

from renderer.errors import InputError
from renderer.optics import burley, gaussians, models, separable, transmittance
from renderer.optics.dipole import Dipole
from renderer.optics.medium import MEDIA, Stack, preset


@pytest.fixture(scope="module")
def marble():
    """Radii, the dipole's R of marble's green channel, and its total."""
    medium = MEDIA["marble"]
    r = np.geomspace(medium.mfp[1] / 100, 12 * medium.dmfp[1], 400)
    dipole = Dipole(preset("marble"))
    return r, dipole.reflectance(r)[:, 1], float(dipole.totals()[0][1])


@pytest.mark.parametrize(
    ("weights", "variances", "error"),
    [  # recomputed, d'Eon's fitting notebook; no constraint on the sum
        ((0.3395,), (0.1259,), None),
        ((0.2034, 0.3756), (0.07216, 1.0595), 0.0956),
        ((0.0703, 0.1838, 0.2058, 0.2883), (0.03628, 0.1460, 0.9090, 6.9868), 0.0125),
    ],
)
def test_free_fit_finds_the_published_one(marble, weights, variances, error):
    r, target, _ = marble
    fit = gaussians.fit(r, target, len(weights), None)
    np.testing.assert_allclose(fit.weights, weights, rtol=4e-3)
    np.testing.assert_allclose(fit.variance_mm2, variances, rtol=6e-3)
    if error:
        assert fit.error == pytest.approx(error, abs=6e-5)
        published = gaussians.reflectance(r, np.array(variances), np.array(weights))
        assert gaussians.radial_error(r, target[:, None], published[:, None])[0] == pytest.approx(
            error, abs=6e-5
        )


def test_constrained_fit_keeps_the_albedo_and_gets_better_with_terms(marble):
    r, target, total = marble
    errors = []
    for terms in (1, 2, 3, 4, 6, 8):
        fit = gaussians.fit(r, target, terms, total)
        assert (
            fit.weights.sum() == pytest.approx(total, rel=1e-12)
            and (fit.weights >= 0).all()
            and (np.diff(fit.variance_mm2) > 0).all()
        )
        assert fit.error == pytest.approx(
            gaussians.radial_error(r, target[:, None], fit.reflectance(r)[:, None])[0]
        )
        errors.append(fit.error)
    assert (np.diff(errors) < 0).all() and errors[3] < 0.02 and errors[5] < 1e-3


def test_a_sum_of_gaussians_is_found_again():
    r = np.geomspace(1e-3, 12, 400)
    variance, weights = np.array([0.02, 0.3, 4.0]), np.array([0.2, 0.5, 0.3])
    fit = gaussians.fit(r, gaussians.reflectance(r, variance, weights), 3, 1.0)
    np.testing.assert_allclose(fit.variance_mm2, variance, rtol=1e-4)
    np.testing.assert_allclose(fit.weights, weights, rtol=1e-4)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"terms": 0}, "terms is 0"),
        ({"terms": 2.5}, "terms is 2.5"),
        ({"terms": 21}, "terms is 21"),
        ({"r_mm": np.ones(400)}, "increasing radii"),
        ({"target": np.full(400, np.nan)}, "finite"),
        ({"total": -1.0}, "finite with a positive total"),
    ],
)
def test_bad_fits(marble, change, words):
    r, target, total = marble
    with pytest.raises(InputError, match=words):
        gaussians.fit(**({"r_mm": r, "target": target, "terms": 2, "total": total} | change))


def test_gaussian_sum_of_a_medium():
    model = models.make("gaussian_sum", preset("skin1"), terms=5)
    r = np.geomspace(0.05, 8, 30)
    np.testing.assert_allclose(
        model.reflectance(r), Dipole(preset("skin1")).reflectance(r), rtol=0.3, atol=1e-3
    )
    assert max(f.error for f in model.fits()) < 0.01
    slab = models.make("gaussian_sum", Stack.of(MEDIA["skin1"], 0.8), terms=5)
    assert (slab.totals()[1] < slab.totals()[0]).all()


# Separable kernels of d'Eon and Luebke's red profile.
def red(r):
    return gaussians.reflectance(r)[:, 0]


@pytest.fixture(scope="module")
def kernels():
    return {
        "svd": separable.svd(red, 8.0, 120),
        "preintegrated": separable.preintegrated(red, 8.0, 120),
        **{f"guided {k}": separable.guided(red, 8.0, k, 120) for k in (0, 2)},
        "artist": separable.artist_fit(red, 8.0, 120)[0],
    }


@pytest.mark.parametrize("name", ["svd", "preintegrated", "guided 0", "guided 2", "artist"])
def test_kernels_are_symmetric_positive_and_keep_the_energy(kernels, name):
    kernel = kernels[name]
    np.testing.assert_array_equal(kernel.a, kernel.a[::-1])
    np.testing.assert_array_equal(kernel.x_mm, -kernel.x_mm[::-1])
    assert (kernel.a >= 0).all() and np.isfinite(kernel.a).all()
    if name == "svd":
        assert 0.3 < kernel.total**2 < 0.9  # "not energy preserving": the paper
    else:
        assert kernel.total == pytest.approx(1, abs=2e-3 if name == "artist" else 1e-9)
    offsets = separable.tap_offsets(17, 6.0)
    weights = kernel.taps(offsets)
    assert weights.sum() == pytest.approx(1, abs=1e-12)
    np.testing.assert_allclose(weights, weights[::-1], atol=1e-12)


def test_svd_has_the_least_rms_error(kernels):
    """Eckart and Young."""
    assert all(
        kernels["svd"].rms_error < kernel.rms_error
        for name, kernel in kernels.items()
        if name != "svd"
    )
    assert kernels["guided 0"].rms_error < kernels["preintegrated"].rms_error
    assert kernels["guided 0"].rms_error < kernels["guided 2"].rms_error


def test_guide_trades_the_peak_for_the_tail(kernels):
    """Jimenez 2015, fig. 5: k = 0 follows the peak, k = 2 the tail."""
    x = kernels["guided 0"].x_mm
    R = red(np.hypot(x[:, None], x).ravel()).reshape(len(x), -1)
    tail = np.hypot(x[:, None], x) > 1.0
    miss = {name: np.abs(np.outer(k.a, k.a) - R)[tail].sum() for name, k in kernels.items()}
    assert miss["guided 2"] < 0.5 * miss["guided 0"]
    centre = len(x) // 2
    assert abs(kernels["guided 0"].a[centre] ** 2 / kernels["svd"].a[centre] ** 2 - 1) < 0.1
    assert kernels["guided 2"].a[centre] ** 2 < 0.3 * kernels["guided 0"].a[centre] ** 2


def test_preintegrated_is_the_sum_of_one_dimensional_gaussians(kernels):
    kernel = kernels["preintegrated"]
    h = kernel.spacing_mm / 2
    inner = np.abs(kernel.x_mm) < 5
    exact = gaussians.line_integral(kernel.x_mm - h, kernel.x_mm + h)[:, 0] / (2 * h)
    np.testing.assert_allclose(kernel.a[inner], exact[inner], rtol=0.02, atol=2e-3)


def test_preintegrated_is_exact_for_additively_separable_light():
    """Eq. 3.5: for E_1(x) + E_2(y) two passes are the 2-D convolution."""
    x = np.arange(-40, 41) * 0.2
    R = red(np.maximum(np.hypot(x[:, None], x), 0.05).ravel()).reshape(81, 81)
    R /= R.sum()
    a = R.sum(axis=1)
    rng = np.random.default_rng(2)
    E = rng.uniform(size=81)[:, None] + rng.uniform(size=81)[None, :]
    fft = np.fft.fft2
    full = np.fft.ifft2(fft(E) * fft(R)).real
    passes = np.fft.ifft2(fft(E) * fft(np.outer(a, a))).real
    np.testing.assert_allclose(passes, full, atol=1e-12)
    impulse = np.zeros((81, 81))
    impulse[40, 40] = 1
    assert (
        np.abs(np.fft.ifft2(fft(impulse) * (fft(R) - fft(np.outer(a, a)))).real).max() > 1e-3
    )  # and not otherwise


def test_artist_gaussians_are_normalised_along_a_line():
    """Vuletic eq. 3.8 prints 1 / (2 pi sigma), which loses a factor of sqrt(2 pi)."""
    x = np.linspace(-20, 20, 8001)
    a = separable.artist(x, (0.1, 0.2, 0.3), (1.0, 0.5, 2.0), (0.3, 0.5, 0.9), scale=1.4)
    np.testing.assert_allclose(np.trapezoid(a, x, axis=0), 1, atol=1e-9)
    np.testing.assert_allclose(
        np.trapezoid(a * x[:, None] ** 2, x, axis=0),
        1.96
        * (
            np.array([0.3, 0.5, 0.9]) * np.array([0.01, 0.04, 0.09])
            + np.array([0.7, 0.5, 0.1]) * np.array([1.0, 0.25, 4.0])
        ),
        rtol=1e-6,
    )
    _kernel, (near, far, w) = separable.artist_fit(
        lambda r: gaussians.reflectance(r, np.array([0.05, 1.0]), np.array([0.4, 0.6])), 8.0, 300
    )
    assert (
        near == pytest.approx(np.sqrt(0.05), rel=0.03)
        and far == pytest.approx(1.0, rel=0.01)
        and w == pytest.approx(0.4, rel=0.02)
    )


def test_the_demo_kernel_has_the_printed_tables():
    """recomputed: centre weights and first taps of the tables printed in the published code."""
    for taps, centre, first in (
        (11, (0.560479, 0.669086, 0.784728), (0.00471692, 1.84771e-4, 5.07566e-5)),
        (17, (0.536343, 0.624624, 0.748867), (0.00317394, 1.34823e-4, 3.77269e-5)),
        (25, (0.530605, 0.613514, 0.739601), (9.73794e-4, 1.11862e-5, 9.43437e-7)),
    ):
        _, weights = separable.demo_kernel(taps)
        np.testing.assert_allclose(weights[taps // 2], centre, rtol=2e-6)
        np.testing.assert_allclose(weights[0], first, rtol=5e-6)


@pytest.mark.parametrize(
    "bad",
    [
        lambda: separable.artist(np.zeros(1), 0.0, 1.0, 0.5),
        lambda: separable.artist(np.zeros(1), 0.1, 1.0, 1.5),
        lambda: separable.svd(red, -1.0),
        lambda: separable.guided(red, 8.0, -1),
        lambda: separable.guided(red, 8.0, 2, b=0),
        lambda: separable.preintegrated(red, np.nan),
    ],
)
def test_bad_kernels(bad):
    with pytest.raises(InputError, match="expected"):
        bad()


# Transmittance.
def test_transmittance_of_any_sum():
    variance, weights = np.array([0.1, 2.0]), np.array([[0.5], [0.3]])
    got = gaussians.transmittance(np.array([0.0, 1.0]), False, variance, weights)[:, 0]
    np.testing.assert_allclose(got, (0.8, 0.5 * np.exp(-5.0) + 0.3 * np.exp(-0.25)))


def test_beer():
    np.testing.assert_allclose(
        transmittance.beer([0.0, 2.0], [0.5, 1.0]), [[1, 1], [np.exp(-1), np.exp(-2)]]
    )
    sigma_t = transmittance.beer_of(0.7, [0.5, 0.1])
    np.testing.assert_allclose(transmittance.beer([0.7], sigma_t)[0], (0.5, 0.1))
    for bad in (
        lambda: transmittance.beer([1.0], [-1.0]),
        lambda: transmittance.beer([np.nan], [1.0]),
        lambda: transmittance.beer_of(0.0, [0.5]),
    ):
        with pytest.raises(InputError):
            bad()


def test_burley_and_gaussians_transmit_alike():
    """Profiles of one mean radius let through about as much."""
    s = np.linspace(0, 3, 20)
    exact = gaussians.transmittance(s)[:, 0]
    by_burley = burley.transmittance(s, burley.from_mean_radius(gaussians.mean_radius()[0]))
    np.testing.assert_allclose(by_burley, exact, atol=0.08)

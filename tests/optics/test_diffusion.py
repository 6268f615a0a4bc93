"""Dipoles, multipole, layers, quantized diffusion: numbers recomputed independently and properties
that each must have.
"""

import numpy as np
import pytest
from scipy.integrate import quad

from renderer.errors import InputError
from renderer.optics import chandrasekhar, models, single
from renderer.optics.dipole import BetterDipole, Dipole, grosjean_D
from renderer.optics.layered import Faces, Layered, join
from renderer.optics.medium import MEDIA, SKIN_THREE_LAYERS, Layer, Medium, Stack, preset
from renderer.optics.multipole import Multipole
from renderer.optics.quantized_diffusion import QuantizedDiffusion, w_E, w_phi


def one(sigma_a, sigma_s_prime, eta, thickness=np.inf, **rest) -> Stack:
    return Stack.of(Medium((sigma_a,), (sigma_s_prime,), eta), thickness, **rest)


def integral(curve, r_max, r_min=1e-7) -> np.ndarray:
    """int f 2 pi r dr by Gauss and Legendre over panels in log r, all channels."""
    t, w = np.polynomial.legendre.leggauss(16)
    edges = np.linspace(np.log(r_min), np.log(r_max), 121)
    half = 0.5 * np.diff(edges)
    x = (0.5 * (edges[1:] + edges[:-1])[:, None] + half[:, None] * t).ravel()
    r = np.exp(x)
    return ((half[:, None] * w).ravel() * 2 * np.pi * r**2) @ curve(r)


JENSEN_TOTALS = {  # recomputed
    "apple": (0.846, 0.841, 0.528),
    "chicken1": (0.314, 0.156, 0.126),
    "chicken2": (0.321, 0.160, 0.108),
    "cream": (0.976, 0.900, 0.725),
    "ketchup": (0.164, 0.006, 0.002),
    "marble": (0.830, 0.791, 0.753),
    "potato": (0.764, 0.612, 0.213),
    "skimmilk": (0.815, 0.813, 0.682),
    "skin1": (0.436, 0.227, 0.131),
    "skin2": (0.623, 0.433, 0.343),
    "spectralon": (1, 1, 1),
    "wholemilk": (0.908, 0.881, 0.759),
}


@pytest.mark.parametrize("name", JENSEN_TOTALS)
def test_dipole_totals_of_the_measured_materials(name):
    np.testing.assert_allclose(Dipole(preset(name)).totals()[0], JENSEN_TOTALS[name], atol=6e-4)


def test_dipole_values():
    np.testing.assert_allclose(
        Dipole(preset("skin1")).reflectance([0.1, 1, 5])[:, 1],
        (0.0617124, 0.0182332, 1.02534e-4),
        rtol=2e-5,
    )  # recomputed


@pytest.mark.parametrize(
    ("eta", "totals"),
    [  # recomputed
        (1.3, (0.0289, 0.1312, 0.2434, 0.6421)),
        (1.4, (0.0249, 0.1134, 0.2135, 0.6045)),
        (1.5, (0.0216, 0.0984, 0.1872, 0.5665)),
    ],
)
def test_better_dipole_totals(eta, totals):
    stack = Stack.of(Medium((0.5, 0.2, 0.1, 0.01), (0.5, 0.8, 0.9, 0.99), eta))
    np.testing.assert_allclose(BetterDipole(stack).totals()[0], totals, atol=6e-5)


def test_better_dipole_values():
    np.testing.assert_allclose(
        BetterDipole(one(0.1, 0.9, 1.4)).reflectance([0.1, 1, 5])[:, 0],
        (0.029665, 0.012714, 2.8705e-4),
        rtol=5e-5,
    )  # recomputed


@pytest.mark.parametrize(
    "name",
    [
        "dipole",
        "better_dipole",
        "multipole",
        "layered",
        "quantized_diffusion",
        "burley",
        "gaussian_sum",
    ],
)
@pytest.mark.parametrize("medium", ["skin1", "marble", "apple", "ketchup"])
def test_each_model_integrates_to_its_total(name, medium):
    stack = preset(medium)
    model = models.make(name, stack)
    got = integral(
        model.reflectance,
        40 * float(stack.layers[0].medium.dmfp.max())
        + 40 * float(stack.layers[0].medium.mfp.max()),
    )
    np.testing.assert_allclose(got, model.totals()[0], rtol=2e-5, atol=1e-7)
    assert (model.totals()[0] > 0).all() and (model.totals()[0] < 1).all()


@pytest.mark.parametrize("name", ["multipole", "layered", "quantized_diffusion"])
def test_slabs_integrate_to_their_totals(name):
    stack = Stack.of(MEDIA["marble"], 2.0, n_below=1.33)
    model = models.make(name, stack)
    for curve, total in zip((model.reflectance, model.transmittance), model.totals(), strict=True):
        np.testing.assert_allclose(integral(curve, 60.0), total, rtol=2e-5)


@pytest.mark.parametrize("name", ["dipole", "multipole", "quantized_diffusion", "layered"])
def test_without_absorption_nothing_is_lost(name):
    R, T = models.make(
        name, Stack.of(MEDIA["spectralon"], 1.0) if name != "dipole" else preset("spectralon")
    ).totals()
    np.testing.assert_allclose(
        R + (0 if T is None else T), 1, atol=2e-3 if name == "quantized_diffusion" else 1e-6
    )


@pytest.mark.parametrize(
    ("eta", "sigma_a", "sigma_s", "d", "R", "T"),
    [  # recomputed
        (1.5, 0.0041, 2.62, 1, 0.52906, 0.44990),
        (1.5, 0.0041, 2.62, 4, 0.7243, 0.1962),
        (1.0, 0.02, 2.0, 2, 0.6398, 0.2727),
        (1.0, 0.02, 2.0, 4, 0.7243, 0.1193),
    ],
)
def test_multipole_totals(eta, sigma_a, sigma_s, d, R, T):
    got = Multipole(one(sigma_a, sigma_s, eta, d)).totals()
    np.testing.assert_allclose([got[0][0], got[1][0]], [R, T], atol=6e-5)


@pytest.mark.parametrize(
    ("images", "R", "T"), [(1, 0.618, 0.357), (2, 0.559, 0.418), (5, 0.5302, 0.4487)]
)  # recomputed
def test_multipole_with_few_images(images, R, T):
    model = Multipole(one(0.0041, 2.62, 1.5, 1.0), images)
    assert integral(model.reflectance, 2000.0)[0] == pytest.approx(R, abs=6e-4)
    assert integral(model.transmittance, 2000.0)[0] == pytest.approx(T, abs=6e-4)


def test_thick_multipole_is_the_dipole():
    r = np.geomspace(0.01, 20, 50)
    np.testing.assert_allclose(
        Multipole(Stack.of(MEDIA["skin1"], 500.0)).reflectance(r),
        Dipole(preset("skin1")).reflectance(r),
        rtol=1e-9,
    )


def test_roughness_lowers_internal_reflection_and_so_the_tail():
    smooth, rough = (Dipole(Stack.of(MEDIA["skin1"], roughness=m)).totals()[0] for m in (0.0, 0.5))
    assert (rough > smooth).all()


def test_thin_slab_is_refused():
    with pytest.raises(InputError, match="thinner than its mean free path"):
        Multipole(Stack.of(MEDIA["marble"], 0.3))


# Layers.
def test_hankel_is_the_sum_over_images():
    stack = one(0.0041, 2.62, 1.5, 1.0)
    r = np.array([0.01, 0.3, 1.0, 3.0, 10.0])
    np.testing.assert_allclose(
        Layered(stack).reflectance(r), Multipole(stack).reflectance(r), rtol=1e-8
    )
    np.testing.assert_allclose(
        Layered(stack).transmittance(r), Multipole(stack).transmittance(r), rtol=1e-8
    )


def test_images_beyond_the_last_one_are_not_forgotten():
    """Nothing absorbs, so the sum over images ends slowly; Hankel's spectrum has no end to it."""
    stack = one(0.0, 10.0, 1.3, 2.0)
    r = np.array([0.1, 1.0, 4.0, 6.0])
    np.testing.assert_allclose(
        Multipole(stack).transmittance(r), Layered(stack).transmittance(r), rtol=1e-5
    )
    np.testing.assert_allclose(
        Multipole(stack).reflectance(r), Layered(stack).reflectance(r), rtol=1e-5
    )
    with pytest.raises(InputError, match="too far"):
        Layered(stack).reflectance([1e6])


@pytest.mark.parametrize(
    "stack",
    [
        Stack(tuple(Layer(Medium((0.02,), (2.0,), 1.0), 1.0) for _ in range(2)), name="halves"),
        Stack(
            (
                Layer(Medium((0.1,), (4.0,), 1.5), 0.7),
                Layer(Medium((0.02,), (1.5,), 1.3), 2.0),
                Layer(Medium((0.3,), (2.0,), 1.4)),
            ),
            name="three indices",
        ),
    ],
    ids=lambda stack: stack.name,
)
def test_fft_and_hankel_agree(stack):
    x, R, T = Layered(stack).grid(size=1024)
    pick = np.array([1, 5, 10, 20, 50])
    np.testing.assert_allclose(R[pick], Layered(stack).reflectance(x[pick]), rtol=1e-4)
    if np.isfinite(stack.thickness_mm):
        np.testing.assert_allclose(T[pick], Layered(stack).transmittance(x[pick]), rtol=1e-4)


def test_fft_method_interpolates_its_grid():
    stack = Stack(tuple(Layer(Medium((0.02,), (2.0,), 1.0), 1.0) for _ in range(2)))
    r = np.array([0.05, 0.33, 1.7, 4.0])
    np.testing.assert_allclose(
        Layered(stack, "fft").reflectance(r), Layered(stack).reflectance(r), rtol=1e-3
    )
    with pytest.raises(InputError, match="grid ends"):
        Layered(stack, "fft").reflectance([1e4])


@pytest.mark.parametrize(
    ("d", "R", "T"), [(2.0, 0.6226, 0.2939), (4.0, 0.7203, 0.1259)]
)  # recomputed
def test_two_halves(d, R, T):
    half = Layer(Medium((0.02,), (2.0,), 1.0), d / 2)
    got = Layered(Stack((half, half))).totals()
    np.testing.assert_allclose([got[0][0], got[1][0]], [R, T], atol=6e-5)


def test_join_of_special_layers():
    a = Faces(*map(np.array, (0.5, 0.3, 0.4, 0.35)))
    black = join(a, Faces(*map(np.array, (0.0, 0.0, 0.0, 0.0))))
    assert black.R == 0.5 and black.T == 0
    clear = Multipole(one(0.0, 2.0, 1.4, 3.0))
    below = Multipole(one(0.0, 2.0, 1.4, 3.0).flipped())
    mirror = join(
        Faces(*clear.spectrum(0.0), *below.spectrum(0.0)),
        Faces(*map(np.array, (1.0, 0.0, 1.0, 0.0))),
    )
    assert pytest.approx(1, abs=1e-9) == mirror.R


def test_join_is_associative():
    rng = np.random.default_rng(1)
    a, b, c = (Faces(*rng.uniform(0.05, 0.45, (4, 5))) for _ in range(3))
    for left, right in zip(join(join(a, b), c), join(a, join(b, c)), strict=True):
        np.testing.assert_allclose(left, right, rtol=1e-12)


def test_an_asymmetric_first_layer_needs_both_its_faces():
    """Vuletic eq.

    2.82 writes R12 = R1 + T1 R2 T1 / (1 - R1 R2) with one R1 and T1 for both sides: right only
    without mismatch.
    """
    for eta_below, same in ((1.4, False), (1.0, True)):
        layer = one(0.05, 2.0, 1.4, 2.0, n_below=eta_below)
        R, T = Multipole(layer).totals()
        R_below, T_below = Multipole(layer.flipped()).totals()
        assert (
            R_below == pytest.approx(R, rel=1e-6) and T_below == pytest.approx(T, rel=1e-6)
        ) is same


def test_three_layer_skin_is_red():
    R, T = Layered(SKIN_THREE_LAYERS).totals()
    assert R[0] > R[1] > R[2] and (T == 0).all()
    r = np.geomspace(0.01, 8, 40)
    profile = Layered(SKIN_THREE_LAYERS).reflectance(r)
    reach = np.trapezoid(profile * r[:, None] ** 2, r, axis=0) / np.trapezoid(
        profile * r[:, None], r, axis=0
    )
    assert reach[0] > reach[1] > reach[2]


# Quantized diffusion.
@pytest.mark.parametrize(
    ("sigma_a", "d", "R", "T"),
    [(0.02, 1, 0.4334, 0.3437), (0.02, 4, 0.5961, 0.1414), (0.1, 1, 0.3161, 0.2322)],
)
def test_quantized_diffusion_against_an_analytic_slab(sigma_a, d, R, T):
    """recomputed (c): one-dimensional analytic slab, sigma_s' = 2, eta = 1.4."""
    got = QuantizedDiffusion(one(sigma_a, 2.0, 1.4, d), ratio=1.05).totals()
    np.testing.assert_allclose([got[0][0], got[1][0]], [R, T], rtol=2e-3)


@pytest.mark.parametrize(("d", "scattered"), [(2, 0.8647), (4, 0.9817), (8, 0.9997)])
def test_quantized_diffusion_without_absorption(d, scattered):
    """recomputed (d): R + T = 1 - exp(-mu_t' d): all that scatters at all."""
    assert sum(QuantizedDiffusion(one(0.0, 1.0, 1.4, d), ratio=1.05).totals())[0] == pytest.approx(
        scattered, rel=2e-3
    )


@pytest.mark.parametrize(
    ("ratio", "total"), [(1.1, 0.23497), (1.2, 0.2346), (1.5, 0.2328), (2.0, 0.2285)]
)
def test_quantized_diffusion_of_a_half_space(ratio, total):
    """recomputed (e); 0.23640 for infinitely fine slices. Slices start elsewhere there, which is
    half a per cent.
    """
    assert QuantizedDiffusion(one(0.1, 0.9, 1.4), ratio=ratio).totals()[0][0] == pytest.approx(
        total, rel=6e-3
    )
    assert QuantizedDiffusion(one(0.1, 0.9, 1.4), ratio=1.01).totals()[0][0] == pytest.approx(
        0.23640, rel=2e-3
    )


@pytest.mark.parametrize("m", [-3.0, 0.0, 0.4, 6.0])
@pytest.mark.parametrize("v", [1e-4, 0.3, 1e3, 1e8])
def test_weights_are_their_integrals(v, m):
    """The weights of BSSRDF notes, whose printed forms overflow for large v, against quadrature of
    what they stand for.
    """
    albedo, sigma_t, D, z2 = 0.8, 1.3, 0.3, 4.0
    gauss = lambda z, s=m: np.exp(-((z + s) ** 2) / (2 * v)) / np.sqrt(2 * np.pi * v)
    near = [p for p in (-m - 5 * np.sqrt(v), -m, -m + 5 * np.sqrt(v)) if 0 < p < z2]
    phi = quad(
        lambda z: gauss(z) * albedo * sigma_t * np.exp(-sigma_t * z),
        0,
        z2,
        points=near or None,
        limit=400,
    )[0]
    flux = quad(
        lambda z: D * (z + m) / v * gauss(z) * albedo * sigma_t * np.exp(-sigma_t * z),
        0,
        z2,
        points=near or None,
        limit=400,
    )[0]
    assert w_phi(np.array([v]), 0.0, z2, m, albedo, sigma_t)[0] == pytest.approx(
        phi, rel=1e-6, abs=1e-13
    )
    assert w_E(np.array([v]), 0.0, z2, m, albedo, sigma_t, D)[0] == pytest.approx(
        flux, rel=1e-5, abs=1e-12
    )


def test_slices_are_the_diffusion_kernel():
    """recomputed (a): sum of w_i G_3D(v_i, r) against exp(-mu_tr r) / (4 pi D r): -0.07 % near the
    source for ratio 1.1.
    """
    mu_a, D, s, first = 0.1, float(grosjean_D(0.1, 0.9)), 1.1, 1e-6
    tau = np.concatenate([[0.0], first * s ** np.arange(220)])
    v, w = D * (tau[1:] + tau[:-1]), (np.exp(-tau[:-1] * mu_a) - np.exp(-tau[1:] * mu_a)) / mu_a
    r = 1.0
    got = (w * np.exp(-(r**2) / (2 * v)) / (2 * np.pi * v) ** 1.5).sum()
    assert got == pytest.approx(np.exp(-np.sqrt(mu_a / D) * r) / (4 * np.pi * D * r), rel=2e-3)
    assert w.sum() == pytest.approx(1 / mu_a, rel=1e-4)


# Single scattering and exact totals.
def test_single_scattering():
    """recomputed: all orders less multiple ones, eta = 1: 0.0767, 0.1231, 0.1384, 0.1518 by Monte
    Carlo.
    """
    stack = Stack.of(Medium((0.5, 0.2, 0.1, 0.01), (0.5, 0.8, 0.9, 0.99), 1.0))
    np.testing.assert_allclose(single.total(stack), (0.0767, 0.1231, 0.1384, 0.1518), atol=5e-4)
    assert single.total(stack)[0] == pytest.approx(0.25 * (1 - np.log(2)), rel=1e-9)
    other = Stack.of(Medium((0.2,), (0.8,), 1.4))
    np.testing.assert_allclose(
        integral(lambda r: single.reflectance(other, r), 60.0, 1e-9), single.total(other), rtol=1e-4
    )


def test_exact_totals_without_a_boundary():
    """recomputed, by Monte Carlo there: light straight down and from everywhere."""
    alpha = np.array([0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.998])
    np.testing.assert_allclose(
        chandrasekhar.searchlight_albedo(alpha),
        (0.0572, 0.1154, 0.2087, 0.2852, 0.4153, 0.5357, 0.6710, 0.7526, 0.8176, 0.8796),
        atol=1e-3,
    )
    np.testing.assert_allclose(
        chandrasekhar.diffuse_albedo(alpha),
        (0.0744, 0.1465, 0.2562, 0.3415, 0.4780, 0.5968, 0.7224, 0.7946, 0.8502, 0.9023),
        atol=1e-3,
    )
    for total in (0.01, 0.5, 0.99):
        assert chandrasekhar.searchlight_albedo(chandrasekhar.albedo_of(total)) == pytest.approx(
            total, abs=1e-10
        )
        assert chandrasekhar.diffuse_albedo(chandrasekhar.albedo_of(total, True)) == pytest.approx(
            total, abs=1e-10
        )
    with pytest.raises(InputError):
        chandrasekhar.albedo_of(1.0)


@pytest.mark.parametrize(
    ("eta", "alpha", "total"),
    [
        (1.3, 0.9, 0.2909),
        (1.3, 0.99, 0.6568),
        (1.4, 0.95, 0.3695),
        (1.4, 0.99, 0.6210),
        (1.5, 0.99, 0.5846),
    ],
)
def test_saunderson_is_near_monte_carlo(eta, alpha, total):
    """recomputed"""
    assert chandrasekhar.surface_albedo(alpha, eta) == pytest.approx(total, rel=0.02)


# Faces of the models.
@pytest.mark.parametrize("name", models.MODELS)
def test_every_model_names_its_paper(name):
    assert models.MODELS[name].name == name and models.MODELS[name].paper


def test_bad_use():
    with pytest.raises(InputError, match="no model 'tripole'"):
        models.make("tripole", preset("skin1"))
    with pytest.raises(InputError, match="one layer, got 3"):
        Dipole(SKIN_THREE_LAYERS)
    for name in ("better_dipole", "quantized_diffusion", "burley", "montecarlo"):
        with pytest.raises(InputError, match="smooth faces only"):
            models.make(name, Stack.of(MEDIA["skin1"], roughness=0.3))
    with pytest.raises(InputError, match="radius"):
        Dipole(preset("skin1")).reflectance([-1.0])
    with pytest.raises(InputError, match="radius"):
        Layered(preset("skin1")).reflectance([np.nan])
    with pytest.raises(InputError, match="method"):
        Layered(preset("skin1"), "wavelet")
    with pytest.raises(InputError, match="ratio"):
        QuantizedDiffusion(preset("skin1"), 1.0)

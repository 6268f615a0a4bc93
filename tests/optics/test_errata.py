"""The documents' wrong formulas, as printed and as they should be: docs/profiles.md lists them with
the names of these tests.

Numbers "printed" were recomputed from the formula as the document prints it; an independent program
found the same.
"""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from renderer.optics import burley, fresnel, gaussians
from renderer.optics.dipole import Dipole, grosjean_D
from renderer.optics.medium import Medium, Stack, preset
from renderer.optics.multipole import Multipole
from renderer.optics.quantized_diffusion import QuantizedDiffusion

SIGMA_A, SIGMA_S, ETA = 0.0041, 2.62, 1.5  # marble, green
MARBLE = Medium((SIGMA_A,), (SIGMA_S,), ETA)


def plane(numerator, height, sigma_tr):
    """The whole plane's int of num (1 + sigma_tr d) exp(-sigma_tr d) / (4 pi d^3), d^2 = r^2 +
    height^2.
    """
    return numerator / np.abs(height) * np.exp(-sigma_tr * np.abs(height)) / 2


def images(d, half_period, n=60):
    """z_r,i, z_v,i, albedo, sigma_tr of the slab."""
    i, mfp, A = np.arange(-n, n + 1), MARBLE.mfp[0], fresnel.extrapolation(ETA)
    return (
        2 * i * half_period + mfp,
        2 * i * half_period - mfp - 4 / 3 * A * mfp,
        MARBLE.albedo_prime[0],
        MARBLE.sigma_tr[0],
    )


def test_000_2_67_has_the_source_instead_of_its_distance_to_the_far_face():
    d = 1.0
    z_r, z_v, a, s = images(d, Multipole(Stack.of(MARBLE, d)).geometry()[2][0])
    right = a * (plane(d - z_r, d - z_r, s) - plane(d - z_v, d - z_v, s)).sum()
    printed = a * (plane(-z_r, d - z_r, s) - plane(-z_v, d - z_v, s)).sum()
    assert printed == pytest.approx(-0.116, abs=5e-4)
    assert right == pytest.approx(0.450, abs=5e-4) and Multipole(Stack.of(MARBLE, d)).totals()[1][
        0
    ] == pytest.approx(right, abs=1e-5)


def test_001_3_6_measures_the_distance_from_the_lit_face():
    worst = 0.0
    for d in (1.0, 4.0, 10.0):
        z_r, z_v, a, s = images(d, Multipole(Stack.of(MARBLE, d)).geometry()[2][0])
        printed = a * (plane(d - z_r, z_r, s) - plane(d - z_v, z_v, s)).sum()
        right = Multipole(Stack.of(MARBLE, d)).totals()
        assert right[0][0] + right[1][0] < 1
        worst = max(worst, printed)
    assert worst > 3.5


def test_001_4_2_2_puts_the_images_too_near():
    """Spacing 2 i (d + A(0) D + A(d) D); right: 2 i (d + 2 A(0) D + 2 A(d) D)."""
    d = 1.0
    z_b = 2 / 3 * MARBLE.mfp[0] * fresnel.extrapolation(ETA)
    z_r, z_v, a, s = images(d, d + z_b)
    R, T = (a * (plane(h - z_r, h - z_r, s) - plane(h - z_v, h - z_v, s)).sum() for h in (0.0, d))
    assert pytest.approx((0.307, 0.683), abs=5e-4) == (-R, T)
    got = Multipole(Stack.of(MARBLE, d)).totals()
    assert (got[0][0], got[1][0]) == pytest.approx((0.529, 0.450), abs=5e-4)


def test_without_absorption_the_right_slab_loses_nothing():
    R, T = Multipole(Stack.of(Medium((0.0,), (SIGMA_S,), ETA), 1.0)).totals()
    assert R[0] + T[0] == pytest.approx(1, abs=1e-6)


def test_001_4_2_2_prints_the_reciprocal_of_A():
    A = fresnel.extrapolation(1.3)
    assert pytest.approx(2.603, abs=1e-3) == A and pytest.approx(0.384, abs=1e-3) == 1 / A
    # Physical: more internal reflection moves the zero of the fluence outwards.
    assert fresnel.extrapolation(1.5) > fresnel.extrapolation(1.3) > fresnel.extrapolation(1.0) == 1


def test_001_3_4_1_loses_the_1_over_pi_of_F_dr():
    printed = quad(
        lambda theta: (
            float(fresnel.reflectance(np.cos(theta), 1.3))
            * np.cos(theta)
            * np.sin(theta)
            * 2
            * np.pi
        ),
        0,
        np.pi / 2,
        limit=400,
        points=[np.arcsin(1 / 1.3)],
    )[0]
    assert printed > 1 and printed / np.pi == pytest.approx(
        fresnel.diffuse_reflectance(1.3), abs=1e-7
    )


def test_001_table_4_1_loses_a_zero_of_apple():
    printed = Dipole(Stack.of(Medium((0.0030, 0.0034, 0.46), (2.29, 2.39, 1.97), 1.3))).totals()[0][
        2
    ]
    assert printed == pytest.approx(0.205, abs=5e-4) and Dipole(preset("apple")).totals()[0][
        2
    ] == pytest.approx(0.528, abs=5e-4)


def test_001_4_3_leaves_out_the_ring():
    """The radius outside of which a hundredth is lost: int R dr as printed, int R 2 pi r dr as
    splats need it.
    """
    r = np.geomspace(1e-4, 150, 60001)
    R = Dipole(preset("marble")).reflectance(r)
    for weight, expected in ((np.ones_like(r), (6.05, 4.72, 3.85)), (r, (19.5, 13.9, 10.5))):
        y = R * weight[:, None]
        inside = np.concatenate(
            [np.zeros((1, 3)), np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(r)[:, None], axis=0)]
        )
        got = [float(np.interp(0.99, inside[:, c] / inside[-1, c], r)) for c in range(3)]
        np.testing.assert_allclose(got, expected, rtol=6e-3)


def test_000_2_54_takes_unreduced_coefficients():
    """z_r = 1 / sigma_t' and alpha' = sigma_s' / sigma_t': a beam's first scattering, as far as
    diffusion goes, is one reduced path deep.
    """
    forward = Medium.from_sigma_s((0.01,), (20.0,), 0.9, eta=1.3)
    isotropic = Medium((0.01,), (2.0,), 1.3)
    np.testing.assert_allclose(forward.mfp, isotropic.mfp)
    assert forward.mfp[0] == pytest.approx(10 / forward.sigma_t[0], rel=0.01)


def test_000_3_18_and_002_33_lose_a_2():
    """T(d) = int R(sqrt(r^2 + d^2)) 2 pi r dr has exp(-d^2 / 2v); exp(-d^2 / v) is what the
    published shaders use.
    """
    d = 1.0
    through = quad(
        lambda r: 2 * np.pi * r * gaussians.reflectance(np.array([np.hypot(r, d)]))[0, 0],
        0,
        40,
        limit=400,
    )[0]
    assert gaussians.transmittance(np.array([d]))[0, 0] == pytest.approx(through, rel=1e-8)
    assert gaussians.transmittance(np.array([d]), published=True)[0, 0] / through == pytest.approx(
        0.3047 / 0.4063, rel=1e-3
    )


def test_000_2_84_is_without_albedo():
    A, s = 0.3, 1 / 0.5
    printed = quad(lambda r: s * (np.exp(-s * r) + np.exp(-s * r / 3)) / 4, 0, np.inf)[
        0
    ]  # times 2 pi r
    assert printed == pytest.approx(1) and quad(
        lambda r: 2 * np.pi * r * burley.reflectance(r, 0.5, A), 0, 40
    )[0] == pytest.approx(A, rel=1e-6)


def test_004_grosjean_has_its_r_outside_of_the_root():
    """phi(r) of Grosjean integrates to 1 / mu_a over space with exp(-sqrt(mu_a / D) r), not with
    exp(-sqrt(mu_a r / D)).
    """
    mu_a, mu_s = 0.2, 0.8
    mu_t, D = mu_a + mu_s, float(grosjean_D(mu_a, mu_s))
    ballistic = 1 / mu_t
    tail = 3 * mu_s * mu_t / (2 * mu_a + mu_s)
    right = quad(lambda r: tail * r * np.exp(-np.sqrt(mu_a / D) * r), 0, np.inf)[0]
    printed = quad(lambda r: tail * r * np.exp(-np.sqrt(mu_a / D * r)), 0, np.inf)[0]
    assert ballistic + right == pytest.approx(1 / mu_a, rel=1e-9) and ballistic + printed > 2 / mu_a


def test_004_exit_weights_lack_a_quarter_and_a_half():
    """With C_phi = (1 - 2 C_1) / 4 and C_E = (1 - 3 C_2) / 2 a slab that absorbs nothing returns
    what it scatters; as printed, more than all.
    """
    R, T = QuantizedDiffusion(Stack.of(Medium((0.0,), (1.0,), 1.4), 4.0), ratio=1.05).totals()
    assert R[0] + T[0] == pytest.approx(1 - np.exp(-4.0), rel=2e-3)
    c_phi, c_e = fresnel.exit_weights(1.4)
    assert (4 * c_phi, 2 * c_e) == pytest.approx(
        (1 - fresnel.two_c1_fit(1.4), 1 - fresnel.three_c2_fit(1.4))
    )  # what is printed
    assert 2 * (R[0] + T[0]) > 1.9  # the smaller of the two factors alone


def test_the_list_names_tests_that_exist():
    text = (
        Path(__file__).resolve().parents[2].joinpath("docs/profiles.md").read_text(encoding="utf-8")
    )
    named = re.findall(r"`(test_\w+)::(test_\w+)", text)
    assert len(named) > 20
    for module, name in named:
        (file,) = Path(__file__).parents[1].rglob(f"{module}.py")
        source = file.read_text(encoding="utf-8")
        assert f"\ndef {name}" in source, f"{module}::{name}"


def test_the_page_shows_figures_that_exist():
    docs = Path(__file__).resolve().parents[2] / "docs"
    shown = re.findall(r"\]\((figures/[^)]+)\)", (docs / "profiles.md").read_text(encoding="utf-8"))
    assert len(shown) >= 12 and all((docs / path).is_file() for path in shown)

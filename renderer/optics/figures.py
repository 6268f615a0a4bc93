"""Figures of profiles: any models side by side, and the documents' own figures drawn again."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from renderer.optics import burley_reference, gaussians, models, separable
from renderer.optics.medium import Stack, finest_mm, preset, reach_mm
from renderer.optics.model import Profile

CHANNELS = (("red", "#c8323c"), ("green", "#2d8a3e"), ("blue", "#2c5fb8"))
# Okabe and Ito's colours, which most colour-blind people tell apart; Monte Carlo, the judge, is
# broad and grey below the others.
STYLES = {
    "montecarlo": ("#b0b0b0", "-"),
    "dipole": ("#000000", "--"),
    "better_dipole": ("#0072b2", "-"),
    "multipole": ("#d55e00", "-."),
    "layered": ("#cc79a7", ":"),
    "quantized_diffusion": ("#009e73", "-"),
    "burley": ("#e69f00", "-"),
    "gaussian_sum": ("#56b4e9", "--"),
}


def pyplot():
    """matplotlib without a screen, letters kept as text, the same bytes each time."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.rcParams.update(
        {
            "svg.hashsalt": "subdermal",
            "svg.fonttype": "none",
            "font.size": 9,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.grid": True,
            "grid.alpha": 0.25,
            "legend.frameon": False,
            "figure.constrained_layout.use": True,
        }
    )
    return plt


def save(figure, path: Path) -> None:
    """Write .svg or .png without a date."""
    plt = pyplot()
    metadata = (
        {"Date": None, "Creator": None} if path.suffix.lower() == ".svg" else {"Software": None}
    )
    figure.savefig(path, dpi=130, metadata=metadata)
    plt.close(figure)


def shown_reach(profile: Profile, share: float = 0.97) -> float:
    """The radius within which most of the light of the most far-reaching channel leaves."""
    r = np.geomspace(finest_mm(profile.stack) / 100, reach_mm(profile.stack), 400)
    R = np.nan_to_num(profile.reflectance(r))
    inside = np.cumsum(R * (r * np.gradient(r))[:, None], axis=0)
    return float(
        max(
            np.interp(share, inside[:, c] / inside[-1, c], r)
            for c in range(R.shape[1])
            if inside[-1, c] > 0
        )
    )


def compare(profiles: list[Profile], r_max: float | None = None):
    """R_d(r) of all models, a panel a channel, and T_d(r) below for slabs."""
    plt = pyplot()
    stack = profiles[0].stack
    reach = r_max or max(shown_reach(p) for p in profiles)
    r = np.linspace(reach / 600, reach, 600)
    slab = np.isfinite(stack.thickness_mm)
    figure, axes = plt.subplots(
        1 + slab, 3, figsize=(10.5, 3.4 * (1 + slab)), sharex=True, sharey="row", squeeze=False
    )
    for row, (letter, values) in enumerate(
        (
            ("R", [p.reflectance(r) for p in profiles]),
            ("T", [p.transmittance(r) for p in profiles]),
        )[: 1 + slab]
    ):
        top = max(float(np.nanmax(v)) for v in values if v is not None and np.isfinite(v).any())
        for c, (name, colour) in enumerate(CHANNELS):
            axis = axes[row, c]
            for profile, value in zip(profiles, values, strict=True):
                if value is not None:
                    own, line = STYLES[profile.name]
                    judge = profile.name == "montecarlo"
                    axis.semilogy(
                        r,
                        np.where(value[:, c] > 0, value[:, c], np.nan),
                        color=own,
                        ls=line,
                        lw=4 if judge else 1.2,
                        zorder=1 if judge else 2,
                        label=profile.name,
                    )
            axis.set_ylim(top * 1e-6, top * 2)
            if row == slab:
                axis.set_xlabel("r (mm)")
            if row == 0:
                axis.set_title(name, color=colour, fontsize=10)
            if c == 0:
                axis.set_ylabel(f"{letter}$_d$(r)  (1/mm²)")
    axes[0, 2].legend(fontsize=8)
    thick = f", {stack.thickness_mm:g} mm" if slab else ""
    figure.suptitle(f"{stack.name}{thick}", fontsize=10)
    return figure


# The documents' figures, drawn again. Each takes photons and seed, of which only the Monte Carlo
# ones make use.
def dipole_of_marble(photons: int, seed: int):
    """Rohat fig. 4.4: the dipole's reflectance profile of marble."""
    plt = pyplot()
    figure, axis = plt.subplots(figsize=(5, 3.4))
    r = np.linspace(0.01, 4, 500)
    R = models.make("dipole", preset("marble")).reflectance(r)
    for c, (name, colour) in enumerate(CHANNELS):
        axis.plot(r, R[:, c], color=colour, label=name)
    axis.set(xlabel="r (mm)", ylabel="R$_d$(r)  (1/mm²)", title="Dipole, marble")
    axis.set_xlim(0)
    axis.set_ylim(0)
    axis.legend()
    return figure


def _marble_slab(mean_free_paths: float) -> Profile:
    """Multipole of marble; one mean free path is red's, the longest, so that the slab is as thick
    in each channel.
    """
    marble = preset("marble").layers[0].medium
    return models.make("multipole", Stack.of(marble, mean_free_paths * float(marble.mfp.max())))


def multipole_of_marble(photons: int, seed: int):
    """Rohat fig.

    4.5: reflectance and transmittance profiles of marble 2, 10 and 20 mean free paths thick.
    """
    plt = pyplot()
    figure, axes = plt.subplots(3, 2, figsize=(7.5, 7.5))
    for row, thickness in zip(axes, (2, 10, 20), strict=True):
        profile = _marble_slab(thickness)
        far = 2 + 0.35 * thickness
        for axis, letter, reach in zip(row, "RT", (3.0, far), strict=True):
            r = np.linspace(0.005, reach, 500)
            value = profile.reflectance(r) if letter == "R" else profile.transmittance(r)
            for c, (name, colour) in enumerate(CHANNELS):
                axis.plot(r, value[:, c], color=colour, label=name)
            axis.set(
                title=f"{letter}$_d$, {thickness} mean free paths", xlabel="r (mm)", ylabel="1/mm²"
            )
            axis.set_xlim(0)
            axis.set_ylim(0)
    axes[0, 0].legend()
    return figure


def thin_marble(photons: int, seed: int):
    """Rohat fig.

    4.6: the multipole's transmittance profile where the slab is too thin for it, with the slab by
    quantized diffusion.
    """
    plt = pyplot()
    figure, axes = plt.subplots(1, 2, figsize=(8.4, 3.4))
    r = np.linspace(0.003, 1.5, 500)
    for axis, thickness in zip(axes, (1.15, 1.5), strict=True):
        profile = _marble_slab(thickness)
        better = models.make("quantized_diffusion", profile.stack)
        for c, (name, colour) in enumerate(CHANNELS):
            axis.semilogy(
                r, profile.transmittance(r)[:, c], color=colour, label=f"{name}, multipole"
            )
            axis.semilogy(
                r,
                better.transmittance(r)[:, c],
                color=colour,
                ls=":",
                label=f"{name}, extended source",
            )
        axis.set(
            title=f"T$_d$ of marble, {thickness} mean free paths", xlabel="r (mm)", ylabel="1/mm²"
        )
    axes[1].legend(fontsize=7)
    return figure


def _burley(parametrisation: str, title: str, published: tuple[float, float]):
    def draw(photons: int, seed: int):
        plt = pyplot()
        judged = burley_reference.judge(parametrisation, photons, seed)
        figure, (axis, errors) = plt.subplots(1, 2, figsize=(8.4, 3.4))
        axis.plot(
            judged.albedo,
            judged.s_best,
            ".",
            ms=4,
            color="#555555",
            label="best s for each albedo, Monte Carlo",
        )
        axis.plot(judged.albedo, judged.s_fit, color="#d55e00", label="published curve fit")
        axis.set(xlabel="surface albedo A", ylabel="s", title=title)
        axis.set_ylim(0, 1.15 * max(judged.s_best.max(), judged.s_fit.max()))
        axis.legend(fontsize=8)
        for error, colour, label, paper in (
            (judged.error_best, "#555555", "best s", published[0]),
            (judged.error_fit, "#d55e00", "curve fit", published[1]),
        ):
            errors.plot(
                judged.albedo,
                100 * error,
                color=colour,
                label=f"{label}: mean {100 * error.mean():.1f} % (published {paper} %)",
            )
        errors.set(
            xlabel="surface albedo A",
            ylabel="mean relative error (%)",
            title="Error against Monte Carlo",
        )
        errors.set_ylim(0)
        errors.legend(fontsize=8)
        return figure

    draw.__doc__ = f"Vuletic: {title}, the best s by Monte Carlo and the published fit."
    return draw


def guided_kernels(photons: int, seed: int):
    """Vuletic fig.

    3.5: guided kernels of d'Eon and Luebke's red profile for several k, beside the profile.
    """
    plt = pyplot()
    reach = 6.0
    profile = _red
    kernels = [
        separable.svd(profile, reach),
        *(separable.guided(profile, reach, k) for k in (0, 2)),
        separable.preintegrated(profile, reach),
    ]
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True)
    for axis, title, along in zip(
        axes, ("along an axis", "along the diagonal"), (False, True), strict=True
    ):
        x = kernels[0].x_mm[len(kernels[0].x_mm) // 2 :]
        r = np.maximum(x * np.sqrt(2), 0.02) if along else np.maximum(x, 0.02)
        axis.semilogy(r, profile(r), color="#b0b0b0", lw=4, label="profile")
        for kernel, (colour, line) in zip(
            kernels,
            (("#000000", ":"), ("#0072b2", "-"), ("#d55e00", "-"), ("#009e73", "--")),
            strict=True,
        ):
            half = kernel.a[len(x) - 1 :]
            value = half**2 if along else half * half[0]
            axis.semilogy(
                r,
                np.where(value > 1e-9, value, np.nan),
                color=colour,
                ls=line,
                lw=1.3,
                label=f"{kernel.method} (keeps {100 * kernel.total**2:.0f} %)",
            )
        axis.set(title=f"a(x) a(y) {title}", xlabel="r (mm)", xlim=(0, 5), ylim=(1e-6, 50))
    axes[0].set_ylabel("1/mm²")
    axes[1].legend(fontsize=8)
    return figure


RANKS = (1, 2, 3, 6)


def _red(r: np.ndarray) -> np.ndarray:
    """Red of d'Eon and Luebke's skin, (M,) mm -> 1/mm^2."""
    return gaussians.reflectance(r)[:, 0]


def singular_values(photons: int, seed: int):
    """Vuletic fig. 3.3: singular values of skin's red profile over the plane."""
    plt = pyplot()
    _, values, _ = separable.decompose(_red, 6.0)
    figure, axis = plt.subplots(figsize=(5, 3.4))
    shown = np.abs(values[:12]) / values[0]
    axis.bar(np.arange(1, 13), shown, color="#0072b2")
    axis.set(yscale="log", ylim=(1e-6, 2), xlabel="number", ylabel="singular value over the first")
    axis.set_xticks(np.arange(1, 13))
    whole = (values**2).sum()
    axis.set_title(f"the first holds {100 * values[0] ** 2 / whole:.1f} % of the squares")
    return figure


def ranks(photons: int, seed: int):
    """Vuletic fig. 3.4: skin's red profile and what its decomposition gives by rank."""
    plt = pyplot()
    x, values, vectors = separable.decompose(_red, 6.0)
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True)
    for axis, diagonal in zip(axes, (False, True), strict=True):
        r = np.maximum(x * (np.sqrt(2) if diagonal else 1), 0.02)
        axis.semilogy(r, _red(r), color="#b0b0b0", lw=4, label="profile")
        colours = ("#000000", "#0072b2", "#d55e00", "#009e73")
        for rank, colour in zip(RANKS, colours, strict=True):
            other = vectors[:, :rank] if diagonal else vectors[:1, :rank]
            value = (values[:rank] * vectors[:, :rank] * other).sum(axis=1)
            axis.semilogy(
                r, np.where(value > 1e-9, value, np.nan), color=colour, lw=1.3, label=f"rank {rank}"
            )
        where = "the diagonal" if diagonal else "an axis"
        axis.set(title=f"along {where}", xlabel="r (mm)", xlim=(0, 5), ylim=(1e-6, 50))
    axes[0].set_ylabel("1/mm²")
    axes[1].legend(fontsize=8)
    return figure


def discs(photons: int, seed: int):
    """Vuletic fig. 3.9: one set of distances, by Burley's inverse CDF, at random angles and at
    Fibonacci's.
    """
    from renderer.optics import burley

    plt = pyplot()
    count = 64
    r = burley.inverse_cdf((np.arange(count) + 0.5) / count)
    golden = (np.sqrt(5) - 1) / 2
    turns = {
        "random": np.random.default_rng(seed).random(count),
        "Fibonacci": np.arange(count) * golden % 1,
    }
    figure, axes = plt.subplots(1, 2, figsize=(7, 3.6), sharex=True, sharey=True)
    for axis, (name, turn) in zip(axes, turns.items(), strict=True):
        phi = 2 * np.pi * turn
        axis.plot(r * np.cos(phi), r * np.sin(phi), "o", ms=3.5, color="#0072b2")
        axis.set(title=f"{name} angles", xlabel="x / d", aspect="equal")
    axes[0].set_ylabel("y / d")
    return figure


def sampled_profile(photons: int, seed: int):
    """Rohat fig. 5.1: marble's dipole as textures of few entries, linear between them; and how far
    off that is, beside the one that splats take (entries by the square root of the distance).
    """
    plt = pyplot()
    profile = models.make("dipole", preset("marble"))
    reach, r = 6.0, np.linspace(0.005, 6.0, 3000)
    exact = profile.reflectance(r)[:, 0]
    figure, (axis, errors) = plt.subplots(1, 2, figsize=(9, 3.5))
    axis.plot(r, exact, color="#b0b0b0", lw=4, label="dipole, marble, red")
    for count, colour in ((16, "#d55e00"), (64, "#0072b2"), (256, "#009e73")):
        at = (np.arange(count) + 0.5) / count
        for power, line in ((1, "-"), (2, ":")):
            place = reach * at**power
            got = np.interp(r, place, profile.reflectance(place)[:, 0])
            label = f"{count} entries" if power == 1 else f"{count}, by the root of r"
            worst = np.abs(got - exact).reshape(-1, 75).max(axis=1)  # of 0.15 mm
            errors.semilogy(r[37::75], worst, color=colour, ls=line, label=label)
            if power == 1 and count < 256:
                axis.plot(r, got, color=colour, label=label)
    axis.set(xlim=(0, 2.5), ylim=(0, None), xlabel="r (mm)", ylabel="R$_d$(r)  (1/mm²)")
    axis.legend(fontsize=8)
    errors.set(xlabel="r (mm)", ylabel="off by at most (1/mm²)", ylim=(1e-7, 0.1))
    errors.legend(fontsize=7)
    return figure


def artist_profile(photons: int, seed: int):
    """Vuletic fig. 3.6: the artist's two Gaussians, near and far, per channel."""
    plt = pyplot()
    x = np.linspace(-3, 3, 1201)
    near, far, w = (0.09, 0.07, 0.05), (1.0, 0.45, 0.25), (0.35, 0.45, 0.55)
    a = separable.artist(x, near, far, w)
    figure, axis = plt.subplots(figsize=(5, 3.4))
    for c, (name, colour) in enumerate(CHANNELS):
        axis.plot(
            x,
            a[:, c],
            color=colour,
            label=f"{name}: $\\sigma_n$ {near[c]}, $\\sigma_f$ {far[c]} mm, w {w[c]}",
        )
    axis.set(xlabel="x (mm)", ylabel="a$_m$(x)  (1/mm)", title="Two Gaussians, artist's choice")
    axis.set_ylim(0)
    axis.legend(fontsize=8)
    return figure


def translucency(photons: int, seed: int):
    """T(s) of skin's six Gaussians, exact and as published, beside Burley's and Beer's law through
    the same half-way point.
    """
    from renderer.optics import burley, transmittance

    plt = pyplot()
    s = np.linspace(0, 4, 400)
    exact, published = gaussians.transmittance(s), gaussians.transmittance(s, published=True)
    by_burley = burley.transmittance(s[:, None], burley.from_mean_radius(gaussians.mean_radius()))
    figure, axes = plt.subplots(1, 3, figsize=(10.5, 3.3), sharey=True)
    for c, (axis, (name, colour)) in enumerate(zip(axes, CHANNELS, strict=True)):
        half = float(np.interp(-0.5, -exact[:, c], s))
        axis.plot(s, exact[:, c], color=colour, lw=2, label="six Gaussians, exp(-s²/2v)")
        axis.plot(s, published[:, c], color=colour, ls="--", label="as published, exp(-s²/v)")
        axis.plot(s, by_burley[:, c], color="#e69f00", label="Burley of equal mean radius")
        axis.plot(
            s,
            transmittance.beer(s, transmittance.beer_of(half, [0.5]))[:, 0],
            color="black",
            ls=":",
            label="Beer, equal at one half",
        )
        axis.set(xlabel="thickness s (mm)", title=name)
        axis.set_ylim(0)
    axes[0].set_ylabel("T(s)")
    axes[2].legend(fontsize=8)
    return figure


def transmittance_of_media(photons: int, seed: int):
    """What slabs of three media let through, as a multiple of the albedo: Monte Carlo, which is the
    default of all techniques, and what the others take in its place.
    """
    from renderer.optics import transmittance

    plt = pyplot()
    shown = (("deon_luebke", 8.0), ("skin_three_layers", 8.0), ("marble", 20.0))
    figure, axes = plt.subplots(3, 3, figsize=(10.5, 9.0))
    for row, (medium, reach) in zip(axes, shown, strict=True):
        s = np.linspace(0.0, reach, 300)
        curves = {
            f"{model}, {exponent}" if model == "jimenez" else model: transmittance.curve_of(
                medium, model, exponent
            )
            for model, exponent in (
                ("slab", ""),
                ("jimenez", "exact"),
                ("jimenez", "published"),
                ("burley", ""),
                ("multipole", ""),
                ("beer", ""),
            )
        }
        for c, (axis, (name, colour)) in enumerate(zip(row, CHANNELS, strict=True)):
            for (label, curve), style in zip(curves.items(), ("-", "--", ":", "-", "-", ":")):
                own = label == "slab"
                tint = {"burley": "#e69f00", "multipole": "#56b4e9", "beer": "black"}
                axis.plot(
                    s,
                    np.maximum(curve.at(s)[:, c], 1e-6),
                    color=tint.get(label, colour),
                    ls=style,
                    lw=2.5 if own else 1.2,
                    label="Monte Carlo of slabs" if own else label,
                )
            axis.set(yscale="log", ylim=(1e-3, 4), title=f"{medium}, {name}")
            axis.set_xlabel("thickness (mm)")
        row[0].set_ylabel("T over the albedo")
    axes[0, 2].legend(fontsize=7)
    return figure


FIGURES = {
    "transmittance": transmittance_of_media,
    "001-4.4": dipole_of_marble,
    "001-4.5": multipole_of_marble,
    "001-4.6": thin_marble,
    "000-2.14": _burley("mfp", "Searchlight, mean free path", (4.9, 5.5)),
    "000-2.15": _burley("dmfp", "Searchlight, diffuse mean free path", (6.4, 7.7)),
    "000-2.17": _burley("diffuse", "Diffuse transmission, mean free path", (2.6, 3.9)),
    "000-3.3": singular_values,
    "000-3.4": ranks,
    "000-3.5": guided_kernels,
    "000-3.6": artist_profile,
    "000-3.9": discs,
    "001-5.1": sampled_profile,
    "translucency": translucency,
}

"""A Bayesian multilevel model of all answers: people and images are both samples.

The latent preference of participant p about the pair (left l, right r) at image i is

    eta = w_r + v_ir + u_pr - (w_l + v_il + u_pl) + side + s_p,

w the worth of a technique, v what it gains or loses in one picture, u a person's own taste for it,
s a person's leaning to the right; v, u and s are normal with spreads of their own, so that people
and images are crossed random effects (Clark 1973, doi:10.1016/S0022-5371(73)80014-3; Baayen,
Davidson and Bates 2008, doi:10.1016/j.jml.2007.12.005). Answers are cumulative logits over
thresholds symmetric about 0 (Agresti 1992, doi:10.2307/2347562), as in `analysis.worth.ordinal`.
w, v, u and s have normal priors with spreads that are half-normal, as the thresholds' steps are;
the side's is normal. Their scales are `analysis.options.Sampling`'s.

The posterior is drawn by the No-U-Turn sampler of NumPyro (Phan, Pradhan and Jankowiak 2019,
arXiv:1912.11554), an extra: requirements-bayes.lock. R-hat and effective sizes are its split
R-hat and Geyer's estimate.
"""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import util
from itertools import combinations

import numpy as np
import pandas as pd

from analysis.errors import InputError
from analysis.options import OVERALL, Options
from analysis.responses import Responses

#: Beyond these a posterior is said not to be one: of all parameters the largest R-hat, the smallest
#: effective number of draws.
MOST_R_HAT, FEWEST_DRAWS = 1.01, 400
#: Name of the rows of an image of the same sort that nobody has seen.
NEW_IMAGE = "new image"


@dataclass(frozen=True)
class Posterior:
    """Draws, each (chains, draws, ...), in logits.

    worth (n techniques), centred; image (m images, n): what a technique gains at an image, centred;
    side; thresholds (2): slight and clear; spread: name -> the standard deviation of 'image',
    'taste', 'person_side'; divergences: of all draws.
    """

    techniques: tuple[str, ...]
    images: tuple[str, ...]
    people: int
    answers: int
    worth: np.ndarray
    image: np.ndarray
    side: np.ndarray
    thresholds: np.ndarray
    spread: Mapping[str, np.ndarray]
    divergences: int
    options: Options

    @cached_property
    def at_new_image(self) -> np.ndarray:
        """worth (chains, draws, n) at an image of the same sort that nobody has seen."""
        rng = np.random.default_rng([self.options.seed, 1])
        gained = rng.normal(size=self.worth.shape) * self.spread["image"][..., None]
        return self.worth + gained - gained.mean(axis=-1, keepdims=True)

    def worths(self) -> pd.DataFrame:
        """framing, technique, median, low, high, p_best; for 'overall', 'new image' (where there
        are several) and every image. Intervals are central; p_best: the chance of the largest
        worth.
        """
        rows = []
        for name, draws in self._places.items():
            best = np.bincount(draws.argmax(axis=1), minlength=len(self.techniques)) / len(draws)
            for k, technique in enumerate(self.techniques):
                rows.append((name, technique, *_summary(draws[:, k], self.options.level), best[k]))
        return pd.DataFrame(
            rows, columns=["framing", "technique", "median", "low", "high", "p_best"]
        )

    def pairs(self) -> pd.DataFrame:
        """framing, a, b, median, low, high, p_a_better: of worth of a less worth of b."""
        rows = []
        for name, draws in self._places.items():
            for i, j in combinations(range(len(self.techniques)), 2):
                apart = draws[:, i] - draws[:, j]
                names = (self.techniques[i], self.techniques[j])
                rows.append(
                    (name, *names, *_summary(apart, self.options.level), float((apart > 0).mean()))
                )
        columns = ["framing", "a", "b", "median", "low", "high", "p_a_better"]
        return pd.DataFrame(rows, columns=columns)

    @cached_property
    def _named(self) -> dict[str, np.ndarray]:
        """Name -> draws (chains, draws) of spreads, side, thresholds and worths."""
        named = {f"sd_{name}": draws for name, draws in self.spread.items()}
        named |= {"side": self.side}
        named |= {
            f"threshold_{k}": self.thresholds[..., i] for i, k in enumerate(("slight", "clear"))
        }
        named |= {f"worth.{name}": self.worth[..., k] for k, name in enumerate(self.techniques)}
        return named

    @cached_property
    def trust(self) -> pd.DataFrame:
        """parameter, r_hat, ess."""
        from numpyro.diagnostics import effective_sample_size, split_gelman_rubin

        rows = [
            (name, float(split_gelman_rubin(draws)), float(effective_sample_size(draws)))
            for name, draws in self._named.items()
        ]
        return pd.DataFrame(rows, columns=["parameter", "r_hat", "ess"])

    def parameters(self) -> pd.DataFrame:
        """parameter, median, low, high, r_hat, ess; spreads, side, thresholds and worths."""
        rows = [(name, *_summary(draws, self.options.level)) for name, draws in self._named.items()]
        table = pd.DataFrame(rows, columns=["parameter", "median", "low", "high"])
        return table.merge(self.trust, on="parameter")

    def doubts(self) -> list[str]:
        """Why the draws may not be those of the posterior; empty where nothing says so."""
        table, reasons = self.trust, []
        worst, least = table.r_hat.max(), table.ess.min()
        if not worst <= MOST_R_HAT:
            name = table.parameter[table.r_hat.fillna(np.inf).argmax()]
            reasons.append(f"R-hat of {name} is {worst:.3f}, more than {MOST_R_HAT}")
        if not least >= FEWEST_DRAWS:
            name = table.parameter[table.ess.fillna(0).argmin()]
            reasons.append(f"{name} has {least:.0f} effective draws, fewer than {FEWEST_DRAWS}")
        if self.divergences:
            reasons.append(f"{self.divergences} draws diverged")
        return reasons

    def draws(self) -> bytes:
        """All draws as an .npz: worth, image, side, thresholds, sd_*; with their names."""
        buffer = io.BytesIO()
        np.savez_compressed(
            buffer,
            techniques=np.array(self.techniques),
            images=np.array(self.images),
            worth=self.worth,
            image=self.image,
            side=self.side,
            thresholds=self.thresholds,
            **{f"sd_{name}": values for name, values in self.spread.items()},
        )
        return buffer.getvalue()

    @cached_property
    def _places(self) -> dict[str, np.ndarray]:
        """Name -> worths (all draws, n) there."""
        n = len(self.techniques)
        places = {OVERALL: self.worth.reshape(-1, n)}
        if len(self.images) > 1:
            places[NEW_IMAGE] = self.at_new_image.reshape(-1, n)
            for k, name in enumerate(self.images):
                places[name] = (self.worth + self.image[:, :, k]).reshape(-1, n)
        return places


def _summary(draws: np.ndarray, level: float) -> tuple[float, float, float]:
    low, middle, high = np.quantile(draws, [(1 - level) / 2, 0.5, (1 + level) / 2])
    return float(middle), float(low), float(high)


def sample(
    responses: Responses, options: Options | None = None, progress: bool = False
) -> Posterior:
    """Draw the posterior of a table of answers, by `options.posterior`, its seed and its level;
    InputError where the sampler is not installed.
    """
    options = options or Options()
    sampling = options.posterior
    if util.find_spec("numpyro") is None:
        raise InputError(
            "the Bayesian model needs the sampler NumPyro, which is not installed; expected "
            "`pip install --no-deps -r requirements-bayes.lock`"
        )
    import jax
    import numpyro

    # as many chains side by side as there are cores; read when jax is first used
    numpyro.set_host_device_count(min(sampling.chains, os.cpu_count() or 1))
    numpyro.enable_x64()
    data = _data(responses)
    several = jax.local_device_count() >= sampling.chains
    mcmc = numpyro.infer.MCMC(
        numpyro.infer.NUTS(_model, target_accept_prob=sampling.target_acceptance),
        num_warmup=sampling.warmup,
        num_samples=sampling.draws,
        num_chains=sampling.chains,
        chain_method="parallel" if several else "sequential",
        progress_bar=progress,
    )
    mcmc.run(jax.random.PRNGKey(options.seed), priors=sampling.priors, **data)
    drawn = {name: np.asarray(v) for name, v in mcmc.get_samples(group_by_chain=True).items()}
    return _posterior(
        responses,
        data,
        drawn,
        int(np.asarray(mcmc.get_extra_fields()["diverging"]).sum()),
        options,
    )


def _data(responses: Responses) -> dict:
    """What `_model` takes: an entry an answer, and how many there are of everything."""
    frame = responses.frame
    pictures, techniques = _pictures(responses), _techniques(responses)
    place = {name: k for k, name in enumerate(techniques)}
    a, b = (frame[side].astype(str).map(place).to_numpy(int) for side in ("a", "b"))
    left = frame.a_left.to_numpy(bool)
    return {
        "left": np.where(left, a, b),
        "right": np.where(left, b, a),
        "person": frame.participant.cat.codes.to_numpy(int),
        "picture": pictures.cat.codes.to_numpy(int),
        "category": frame.answer.to_numpy(int) + 2,
        "techniques": len(techniques),
        "people": len(frame.participant.cat.categories),
        "pictures": len(pictures.cat.categories),
    }


def _pictures(responses: Responses) -> pd.Series:
    """The kind of image of every answer: framing, with the levels of a study's further factors."""
    return responses.frame.image_framing.cat.remove_unused_categories()


def _techniques(responses: Responses) -> list[str]:
    seen = {*responses.frame.a, *responses.frame.b}
    return [name for name in responses.codebook.techniques if name in seen]


def _model(priors, left, right, person, picture, category, techniques, people, pictures):
    import jax.numpy as jnp
    import numpyro
    from jax.nn import log_sigmoid
    from numpyro import distributions as dist

    def spread(name):
        return numpyro.sample(f"sd_{name}", dist.HalfNormal(priors[name]))

    def effects(name, *shape):
        size = dist.Normal(0, 1).expand(shape).to_event(len(shape))
        return spread(name) * numpyro.sample(name, size)

    worth = effects("worth", techniques)
    taste = effects("taste", people, techniques)
    # one image cannot tell what is its own from what is the technique's
    image = effects("image", pictures, techniques) if pictures > 1 else jnp.zeros((1, techniques))
    side = numpyro.sample("side", dist.Normal(0, priors["side"]))
    leaning = side + effects("person_side", people)[person]
    steps = jnp.array([priors["slight"], priors["clear"]])
    step = numpyro.sample("step", dist.HalfNormal(steps).to_event(1))
    slight, clear = step[0], step[0] + step[1]

    def value(technique):
        return worth[technique] + image[picture, technique] + taste[person, technique]

    eta = value(right) - value(left) + leaning
    far = 1e3  # the outermost edges, beyond every eta
    edges = jnp.stack([-far, -clear, -slight, slight, clear, far])
    lower, upper = edges[category], edges[category + 1]
    inside = jnp.log(-jnp.expm1(lower - upper))
    numpyro.factor("answers", (log_sigmoid(upper - eta) + log_sigmoid(eta - lower) + inside).sum())


def _posterior(
    responses: Responses,
    data: Mapping,
    drawn: Mapping[str, np.ndarray],
    divergences: int,
    options: Options,
) -> Posterior:
    """The draws as effects about their means: a constant in all worths changes no answer."""
    names = _techniques(responses)

    def centred(values: np.ndarray) -> np.ndarray:
        return values - values.mean(axis=-1, keepdims=True)

    worth = drawn["sd_worth"][..., None] * drawn["worth"]
    if data["pictures"] > 1:
        image = drawn["sd_image"][..., None, None] * drawn["image"]
    else:
        image = np.zeros((*worth.shape[:2], 1, len(names)))
    spreads = [name for name in ("image", "taste", "person_side") if f"sd_{name}" in drawn]
    return Posterior(
        tuple(names),
        tuple(str(name) for name in _pictures(responses).cat.categories),
        data["people"],
        len(responses.frame),
        centred(worth),
        centred(image),
        drawn["side"],
        np.cumsum(drawn["step"], axis=-1),
        {name: drawn[f"sd_{name}"] for name in spreads},
        divergences,
        options,
    )

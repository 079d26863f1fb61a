"""A preference model: what the answers so far say of a decision maker's utility.

The posterior is over linear, Chebyshev and aspiration-point utilities of values that are scaled to the front's range.
An answer is likely under a utility as a softmax of the utilities of what was shown, with a share of answers at random;
how sharp it is and how large the share are inferred, too (Bradley and Terry 1952; Zintgraf et al. 2018). The posterior
is a sample: particles from the prior, resampled by likelihood and moved by Metropolis-Hastings.

Letters: S particles, K policies shown, N policies, M objectives.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.search.scaling import Scale, range_scale

PARTICLES, DRAWN = 512, 2048  # that are kept, and from which they are resampled
MOVES, STEP = 16, 0.4  # of Metropolis-Hastings: how many, and their standard deviation
TEMPERATURES = (0.003, 0.01, 0.03, 0.1)  # of the softmax, in shares of the utility's range over the front
RANDOM_SHARES = (0.02, 0.25)  # of answers
AUGMENTATION = 0.05  # weight of the mean in utilities that look at the worst objective
LINEAR, CHEBYSHEV, ASPIRATION = range(3)
KINDS = (LINEAR, LINEAR, CHEBYSHEV, ASPIRATION)  # in turn, of the particles


@dataclass(frozen=True, eq=False)
class Choice:
    """One answer: which of the vectors that were shown was preferred to all others."""

    shown: np.ndarray  # [K, M]
    preferred: int  # index of a row


@dataclass(frozen=True, eq=False)
class Verdict:
    """The best member of a front by expectation, and what it may cost to trust in that."""

    best: int  # index of a row
    regret: float  # expected loss of utility against the decision maker's own choice, in shares of its range
    probability: float  # that the member is the decision maker's own choice


class PreferenceModel:
    """The posterior after some choices, for judging the members of a front [N, M]."""

    def __init__(self, front: np.ndarray, choices: Sequence[Choice], seed: int):
        self.front = front
        self.scale = range_scale(front)
        self._kinds, self._parameters = _posterior(self.scale, front, choices, np.random.default_rng(seed))

    def utilities(self, values: np.ndarray) -> np.ndarray:
        """Return what vectors [N, M] are worth to each particle [S, N]; the front's worst is 0, its best 1."""
        found, of_front = (
            _utilities(self._kinds, self._parameters, self.scale.apply(each)) for each in (values, self.front)
        )
        least, span = _range(of_front)
        return (found - least[:, None]) / span[:, None]

    def verdict(self) -> Verdict:
        """Return which member of the front is best by expectation."""
        utilities = self.utilities(self.front)  # [S, N]
        best = int(utilities.mean(axis=0).argmax())
        regret = float((utilities.max(axis=1) - utilities[:, best]).mean())
        return Verdict(best, regret, float((utilities.argmax(axis=1) == best).mean()))

    def telling(self, count: int, always: Sequence[int] = ()) -> list[int]:
        """Return rows of the front whose comparison tells most: `always`, and others up to `count`, in order.

        Each is the one that most raises the expected utility of the best of them (qEUBO, Astudillo et al. 2023).
        """
        utilities = self.utilities(self.front)  # [S, N]
        rows = list(dict.fromkeys(always))
        while len(rows) < min(count, len(self.front)):
            best = utilities[:, rows].max(axis=1, keepdims=True, initial=-np.inf)
            gains = np.maximum(utilities, best).mean(axis=0)
            gains[rows] = -np.inf
            rows.append(int(gains.argmax()))
        return sorted(rows)


def _posterior(
    scale: Scale, front: np.ndarray, choices: Sequence[Choice], generator: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return kinds [S] and parameters [S, M] of utilities drawn from the posterior."""
    kinds = np.resize(KINDS, DRAWN)
    parameters = _prior(generator, kinds, front.shape[1])
    ends = scale.apply(front)
    scaled = [(scale.apply(choice.shown), choice.preferred) for choice in choices]
    likelihood = _log_likelihood(kinds, parameters, scaled, ends)
    weights = np.exp(likelihood - likelihood.max())
    # Systematic resampling (Kitagawa 1996).
    positions = (generator.random() + np.arange(PARTICLES)) / PARTICLES
    drawn = np.searchsorted(np.cumsum(weights) / weights.sum(), positions).clip(max=DRAWN - 1)
    kinds, parameters = kinds[drawn], parameters[drawn]
    if not choices:
        return kinds, parameters
    density = likelihood[drawn] + _log_prior(kinds, parameters)
    for _ in range(MOVES):
        proposed = parameters + STEP * generator.normal(size=parameters.shape) * generator.random((PARTICLES, 1))
        found = _log_likelihood(kinds, proposed, scaled, ends) + _log_prior(kinds, proposed)
        accepted = np.log(generator.random(PARTICLES)) < found - density
        parameters = np.where(accepted[:, None], proposed, parameters)
        density = np.where(accepted, found, density)
    return kinds, parameters


def _prior(generator: np.random.Generator, kinds: np.ndarray, objectives: int) -> np.ndarray:
    """Return parameters [S, M]: logarithms of what is proportional to the weights, or logits of an aspiration point.

    Weights are uniform on the simplex, aspiration points uniform between the front's worst and best values.
    """
    shape = len(kinds), objectives
    weights, points = np.log(generator.exponential(size=shape)), generator.logistic(size=shape)
    return np.where((kinds == ASPIRATION)[:, None], points, weights)


def _log_prior(kinds: np.ndarray, parameters: np.ndarray) -> np.ndarray:  # [S]
    weights = (parameters - np.exp(parameters)).sum(axis=1)
    points = (parameters - 2 * np.logaddexp(0, parameters)).sum(axis=1)
    density: np.ndarray = np.where(kinds == ASPIRATION, points, weights)
    return density


def _log_likelihood(
    kinds: np.ndarray, parameters: np.ndarray, choices: Sequence[tuple[np.ndarray, int]], ends: np.ndarray
) -> np.ndarray:  # [S]
    """Return the likelihood of all choices, averaged over temperatures and shares of random answers."""
    total = np.zeros((len(TEMPERATURES), len(RANDOM_SHARES), len(kinds)))  # of all pairs of both, [T, R, S]
    shares = np.array(RANDOM_SHARES)[:, None]
    _, span = _range(_utilities(kinds, parameters, ends))
    for shown, preferred in choices:
        utilities = _utilities(kinds, parameters, shown)  # [S, K]
        behind = (utilities.max(axis=1, keepdims=True) - utilities) / span[:, None]
        for number, temperature in enumerate(TEMPERATURES):
            odds = np.exp(behind / np.float32(-temperature))
            probability = odds[:, preferred] / odds.sum(axis=1)
            total[number] += np.log((1 - shares) * probability + shares / len(shown))
    pairs = total.reshape(-1, len(kinds))
    return np.logaddexp.reduce(pairs, axis=0) - np.log(len(pairs))


def _range(utilities: np.ndarray) -> tuple[np.ndarray, np.ndarray]:  # [S, N] -> [S], [S]
    """Return each particle's least utility, and how far above it the greatest is; 1 where all are equal."""
    least, greatest = utilities.min(axis=1), utilities.max(axis=1)
    return least, np.where(greatest > least, greatest - least, 1)


def _utilities(kinds: np.ndarray, parameters: np.ndarray, values: np.ndarray) -> np.ndarray:  # [S, N] float32
    """Return the utilities of scaled vectors [N, M]. In float32: they are many, and never exact."""
    found = np.empty((len(kinds), len(values)), np.float32)
    parameters, values = parameters.astype(np.float32), values.astype(np.float32)
    largest = parameters.max(axis=1, keepdims=True)
    weights = np.exp(parameters - largest)
    weights /= weights.sum(axis=1, keepdims=True)
    points = 1 / (1 + np.exp(-parameters))
    linear, chebyshev, aspiration = (kinds == kind for kind in (LINEAR, CHEBYSHEV, ASPIRATION))
    found[linear] = weights[linear] @ values.T
    found[chebyshev] = _worst(weights[chebyshev], values - 1)
    found[aspiration] = _worst(np.ones_like(points[aspiration]), values, points[aspiration])
    return found


def _worst(weights: np.ndarray, values: np.ndarray, points: np.ndarray | None = None) -> np.ndarray:
    """Return the least of weighted values [N, M], less points [S, M], and a share of their mean: [S, N]."""
    parts = [
        np.outer(weights[:, index], column) - (0 if points is None else points[:, index, None])
        for index, column in enumerate(values.T)
    ]
    least, total = parts[0], parts[0]
    for part in parts[1:]:
        least, total = np.minimum(least, part), total + part
    return least + np.float32(AUGMENTATION / len(parts)) * total

"""A preference model: what the answers so far say of a decision maker's utility.

The posterior is over linear, Chebyshev and aspiration-point utilities of values that are scaled to the range of the
front's core: beside a policy that is far out in an objective all others would look alike, and no answer would matter.
An answer is likely under a utility as a softmax of the utilities of what was shown, with a share of answers at random;
how sharp it is and how large the share are inferred, too (Bradley and Terry 1952; Plackett 1975 for rankings; Davidson
1970 for no difference; Zintgraf et al. 2018). In each generation somebody may have changed their mind, so that what
they said before counts no more. The posterior is a sample: particles from the prior, resampled by likelihood and moved
by Metropolis-Hastings.

Letters: S particles, A answers, K policies shown, N policies, M objectives, B pairs of temperature and random share.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.search.scaling import Scale, core, core_scale

PARTICLES, DRAWN = 512, 2048  # that are kept, and from which they are resampled
MOVES, STEP = 16, 0.4  # of Metropolis-Hastings: how many, and their standard deviation
# Of the softmax, in shares of the utility's range over the front's core.
TEMPERATURES = np.array([0.003, 0.01, 0.03, 0.1], np.float32)
RANDOM_SHARES = (0.02, 0.25)  # of answers
CHANGE_OF_MIND = 0.01  # how likely it is in a generation
AUGMENTATION = 0.05  # weight of the mean in utilities that look at the worst objective
LINEAR, CHEBYSHEV, ASPIRATION = range(3)
LEADING = 1e-6  # weight of the mean utility among policies whose comparison tells equally much
WITHIN_LIMITS = 0.01  # weight of the utility of what misses the limits, against how much it misses
DRAWS_OF_A_PAIR = 8  # from the posterior, until two differ
KINDS = (LINEAR, LINEAR, CHEBYSHEV, ASPIRATION)  # in turn, of the particles


@dataclass(frozen=True, eq=False)
class Comparison:
    """One answer: how the vectors that were shown compare."""

    shown: np.ndarray  # [K, M]
    ranking: tuple[int, ...]  # rows from the best down; who is not in it is worse; empty: no difference between all
    generation: int = 1  # before which it was given


@dataclass(frozen=True, eq=False)
class Verdict:
    """The best member of a front by expectation, and what it may cost to trust in that."""

    best: int  # index of a row
    regret: float  # expected loss of utility against the decision maker's own choice, in shares of its range
    probability: float  # that the member is the decision maker's own choice


class PreferenceModel:
    """The posterior before a generation, after some answers, for judging the members of a front [N, M].

    What does not reach the limits [M] that the decision maker has set is worse than anything that does.
    """

    def __init__(
        self,
        front: np.ndarray,
        answers: Sequence[Comparison],
        seed: int,
        generation: int = 1,
        limits: np.ndarray | None = None,
    ):
        self.front = front
        self.scale = core_scale(front)
        self._core = front[core(front)]
        self._limits = np.full(front.shape[1], -np.inf) if limits is None else limits
        self._generator = np.random.default_rng(seed)
        self._kinds, self._parameters = _posterior(self.scale, front, answers, generation, self._generator)

    def utilities(self, values: np.ndarray) -> np.ndarray:
        """Return what vectors [N, M] are worth to each particle [S, N]; the worst of the front's core is 0, its best 1.

        What is far out is worth no less than -1: a few particles that have no use for it shall not outvote all others.
        One that does not reach the limits is worth less than that, and the less, the more is missing.
        """
        found, of_core = (
            _utilities(self._kinds, self._parameters, self.scale.apply(each)) for each in (values, self._core)
        )
        least, span = _range(of_core)
        missing = np.maximum(self._limits - values, 0.0) / self.scale.span  # [N, M]
        far = missing.sum(axis=1)
        scaled = np.maximum((found - least[:, None]) / span[:, None], -1.0)
        return np.where(far > 0, WITHIN_LIMITS * scaled - 2 - far, scaled)

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
            gains = np.maximum(utilities, best).mean(axis=0) + LEADING * utilities.mean(axis=0)
            gains[rows] = -np.inf
            rows.append(int(gains.argmax()))
        return sorted(rows)

    def sampled_pair(self) -> list[int]:
        """Return the two rows of the front, of two at least, that two draws from the posterior like best.

        Interactive Thompson sampling (Roijers et al. 2017). Where many draws agree, the second is the one whose
        comparison with the first tells most.
        """
        favourites = self.utilities(self.front).argmax(axis=1)  # [S]
        drawn = [int(each) for each in self._generator.choice(favourites, size=DRAWS_OF_A_PAIR)]
        others = [each for each in drawn if each != drawn[0]]
        return sorted([drawn[0], others[0]]) if others else self.telling(2, drawn[:1])


def _posterior(
    scale: Scale,
    front: np.ndarray,
    answers: Sequence[Comparison],
    generation: int,
    generator: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Return kinds [S] and parameters [S, M] of utilities drawn from the posterior."""
    kinds = generator.permutation(np.resize(KINDS, DRAWN))  # in no order, or resampling in equal steps would drop some
    parameters = _prior(generator, kinds, front.shape[1])
    evidence = _evidence(scale, front, answers)
    likelihoods = _log_likelihoods(kinds, parameters, evidence)  # [A, B, S]
    changed = _changes_of_mind(generator, generation, len(kinds))  # [S]
    counts = np.array([answer.generation for answer in answers])[:, None] >= changed  # [A, S]
    likelihood = _before_changes(likelihoods, counts) + _together(likelihoods, counts)
    weights = np.exp(likelihood - likelihood.max())
    # Systematic resampling (Kitagawa 1996).
    positions = (generator.random() + np.arange(PARTICLES)) / PARTICLES
    drawn = np.searchsorted(np.cumsum(weights) / weights.sum(), positions).clip(max=DRAWN - 1)
    kinds, parameters, counts = kinds[drawn], parameters[drawn], counts[:, drawn]
    if not answers:
        return kinds, parameters
    density = _together(likelihoods[:, :, drawn], counts) + _log_prior(kinds, parameters)
    for _ in range(MOVES):
        proposed = parameters + STEP * generator.normal(size=parameters.shape) * generator.random((PARTICLES, 1))
        found = _together(_log_likelihoods(kinds, proposed, evidence), counts) + _log_prior(kinds, proposed)
        accepted = np.log(generator.random(PARTICLES)) < found - density
        parameters = np.where(accepted[:, None], proposed, parameters)
        density = np.where(accepted, found, density)
    return kinds, parameters


def _changes_of_mind(generator: np.random.Generator, generation: int, count: int) -> np.ndarray:
    """Return for each particle the generation from which answers count [S]: 1 for those that never changed."""
    ago = generator.geometric(CHANGE_OF_MIND, size=count)  # generations since the last change, 1: just now
    return np.maximum(generation + 1 - ago, 1)


def _before_changes(likelihoods: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return the likelihood of the answers that do not count [S]: given by somebody of whom only the prior is known."""
    skipped = (~counts).sum(axis=0)  # [S] the first ones
    running = np.cumsum(likelihoods, axis=0)  # [A, B, S]
    marginal = np.array([0.0, *(np.logaddexp.reduce(each, axis=None) - np.log(each.size) for each in running)])
    return np.asarray(marginal[skipped])


def _together(likelihoods: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return the likelihood of the answers that count [S], averaged over temperatures and shares of random answers."""
    total = np.einsum("abs,as->bs", likelihoods, counts)
    return np.asarray(np.logaddexp.reduce(total, axis=0) - np.log(len(total)))


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


@dataclass(frozen=True, eq=False)
class _Evidence:
    """What was said of which vectors. Most were shown again and again; each is judged once."""

    points: np.ndarray  # [P, M] distinct scaled vectors
    core: np.ndarray  # [N] rows of the front's core
    answers: tuple[tuple[np.ndarray, tuple[int, ...]], ...]  # A: rows [K] of what was shown, and the ranking


def _evidence(scale: Scale, front: np.ndarray, answers: Sequence[Comparison]) -> _Evidence:
    parts = [front[core(front)], *(answer.shown for answer in answers)]
    points, rows = np.unique(np.concatenate(parts), axis=0, return_inverse=True)
    of_core, *of_answers = np.split(rows.ravel(), np.cumsum([len(part) for part in parts])[:-1])
    said = zip(of_answers, (answer.ranking for answer in answers), strict=True)
    return _Evidence(scale.apply(points), of_core, tuple(said))


def _log_likelihoods(kinds: np.ndarray, parameters: np.ndarray, evidence: _Evidence) -> np.ndarray:  # [A, B, S]
    """Return the likelihood of each answer, for each temperature and share of random answers."""
    answers = evidence.answers
    found = np.zeros((len(answers), len(TEMPERATURES), len(RANDOM_SHARES), len(kinds)))
    shares = np.array(RANDOM_SHARES)[:, None]
    of_all = _utilities(kinds, parameters, evidence.points)  # [S, P]
    _, span = _range(of_all[:, evidence.core])
    for answer, (shown, ranking) in zip(found, answers, strict=True):
        utilities = of_all[:, shown]  # [S, K]
        behind = (utilities.max(axis=1, keepdims=True) - utilities) / span[:, None]
        left = np.ones(len(shown), bool)
        for place in ranking[: len(shown) - 1]:
            remaining = behind if left.all() else behind[:, left]
            nearest = remaining.min(axis=1, keepdims=True)  # or the odds of all that are left may vanish
            others, own = remaining - nearest, behind[:, place] - nearest[:, 0]
            for number, temperature in enumerate(TEMPERATURES):
                probability = np.exp(own / -temperature) / np.exp(others / -temperature).sum(axis=1)
                answer[number] += np.log((1 - shares) * probability + shares / left.sum())
            left[place] = False
        if ranking:
            continue
        for number, temperature in enumerate(TEMPERATURES):
            alike = np.exp(-behind.mean(axis=1) / temperature)  # geometric mean of the odds
            probability = alike / (np.exp(behind / -temperature).mean(axis=1) + alike)
            answer[number] += np.log((1 - shares) * probability + shares / (len(shown) + 1))
    return found.reshape(len(answers), len(TEMPERATURES) * len(RANDOM_SHARES), len(kinds))


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

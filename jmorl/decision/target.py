"""An artificial user who wants to reach a point in objective space (the paper, section 4.2.2)."""

from dataclasses import dataclass

import numpy as np

from jmorl.decision.answers import Answer
from jmorl.decision.protocol import DecisionMaker, Question
from jmorl.search.bounds import within
from jmorl.search.scaling import range_scale


@dataclass(frozen=True, eq=False)
class TargetUser(DecisionMaker):
    """Prefers the policy nearest the target, until one reaches it in every objective; then stops with that.

    Distances are Euclidean, in units of the front's range, because the raw units of two objectives need not have
    anything in common; with `scaled` off in the values' own units, as in the paper. Of several policies that reach
    the target it takes the one that clears it by most in its tightest objective, which is the safest claim, as
    scores are estimates. Ties go to the first. It is an aim and nobody's time, and so it is patient.
    """

    target: np.ndarray  # [M]
    scaled: bool = True
    patient = True

    def answer(self, question: Question) -> Answer:
        """Return the preferred member of the question's front."""
        values = question.values
        margins = values - self.target
        if self.scaled:
            margins = margins / range_scale(values).span
        reached = self.satisfied(values)
        index = np.argmax(margins.min(axis=1)) if reached else np.argmin(np.linalg.norm(margins, axis=1))
        return Answer(question.front[int(index)].id, stop=reached)

    def satisfied(self, values: np.ndarray) -> bool:
        """Return whether a run with the front `values` [N, M] may stop early."""
        return bool(within(values, self.target).any())

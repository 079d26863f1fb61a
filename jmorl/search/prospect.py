"""What a choice would mean for the search, before it is made."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Prospect:
    """What choosing a policy would mean for the generation that follows."""

    bounds: np.ndarray  # [M] that would be in force
    kept: np.ndarray  # [N] bool, members of the archive that reach them; the others would be ruled out
    expected: np.ndarray  # [K, M] best of what the prediction model expects within them; K may be zero
    odds: float  # how often training leads at least as far as expected in every objective, from 0 to 1

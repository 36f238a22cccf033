"""w_i from data: how often P_a and P_ni are wrong, and the weight that AdaBoost gives the neighbours for it.

Nav-SCOPE V-C 4: a playground apart from all evaluation worlds, nine samples of the swarm. A choice of a side is
right when it is the side of the shortest way on the true map.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope.evaluation.statistics import Interval

SELF_PRINTED, NEIGHBOUR_PRINTED, WEIGHT_PRINTED = 0.245, 0.446, 0.195


class WeightResult(NamedTuple):
    """Error rates with Wilson intervals, the weight (21) with a bootstrap interval over the samples."""

    own: Interval
    """Error rate of P_a; ``used`` counts choices."""
    neighbours: Interval
    """Error rate of P_ni; ``used`` counts opinions."""
    weight: float
    """|f_ai| by (21); NaN when an error rate is 0 or 1 or the own one is 1/2."""
    low: float
    high: float
    peak_force: float
    """Largest |f_ai| at w_i = 1 in the pass band [1/m]; w_i = weight / peak_force makes the peak optimal."""
    seeds: list[int]


def adaboost_weight(own_error: float, neighbour_error: float) -> float:
    """Return the optimal |f_ai| (Nav-SCOPE 21), natural logarithms; NaN where it does not exist.

    ln((1 - e_n) / e_n) / ln((1 - e_s) / e_s); 0.245 and 0.446 give 0.193 (printed 0.195, readings 11).
    """
    if not (0.0 < own_error < 1.0 and 0.0 < neighbour_error < 1.0) or own_error == 0.5:
        return math.nan
    return math.log((1.0 - neighbour_error) / neighbour_error) / math.log((1.0 - own_error) / own_error)


def count_errors(choices: np.ndarray) -> tuple[int, int, int, int]:
    """Return (own errors, choices, neighbours' errors, opinions) of ``choices`` whose right side is known."""
    known = choices[choices["told_side"] != 0]
    left = known["told_side"] > 0
    own_wrong = int(np.sum((known["p_self"] >= 0.5) != left))
    present = np.arange(known["heard_p"].shape[1])[None, :] < known["heard"][:, None]
    says_left = known["heard_p"] >= 0.5
    return own_wrong, len(known), int(np.sum(present & (says_left != left[:, None]))), int(present.sum())

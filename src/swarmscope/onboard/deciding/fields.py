"""Interaction fields and probabilities of Nav-SCOPE (8)-(15) and SFM-MAS (4)-(8), (12)-(15), (19)-(20)."""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inline

P_FREE = 0.5
"""P_s while no obstacle is observed (SFM-MAS 7); taken in every balance of forces, where it cancels or favours no
side."""


@jit_inline
def sigmoid(x: float) -> float:
    """Return the logistic function of ``x``."""
    return 1.0 / (1.0 + math.exp(-x))


@jit
def interaction_force(distance: float, sigma_a: float, w_i: float) -> float:
    """Return f_ai (Nav-SCOPE 12, SFM-MAS 13) [1/m] towards the neighbour; negative is repulsion.

    0 at ``distance == sigma_a`` [m].
    """
    ratio = sigma_a / distance
    return w_i / sigma_a * (math.exp(1.0 - distance / sigma_a) - ratio * ratio)


@jit
def in_pass_band(distance: float, sigma_a: float) -> bool:
    """Tell whether a neighbour at ``distance`` [m] takes part in the fusion: (sigma_a, 3 sigma_a] (Nav-SCOPE 13)."""
    return sigma_a < distance <= 3.0 * sigma_a


@jit
def left_probability(area_1: float, area_2: float, area_3: float, area_4: float, bias: float) -> float:
    """Return P_a (Nav-SCOPE 9, SFM-MAS 7 and 8 with w_s = 1) from the open areas of quadrants I to IV and b_0."""
    return sigmoid(0.5 * (area_1 - area_2 + area_3 - area_4) + bias)


@jit
def following_probability(x_1: float, x_2: float, threshold: float, on_left: bool) -> float:
    """Return P_ni (Nav-SCOPE 14, SFM-MAS 15) from passable distances and threshold, all normalised by (25).

    The threshold is subtracted (readings 8).
    """
    p = sigmoid(x_1 + x_2 - 2.0 * threshold)
    return p if on_left else 1.0 - p


@jit
def fuse(p_self: float, weighted: float, weights: float) -> float:
    """Return P_dir (Nav-SCOPE 15, SFM-MAS 19-20) with w_a = 1; ``weighted`` = sum P_ni f_ai, ``weights`` = sum f_ai."""
    return (p_self + weighted) / (1.0 + weights)


@jit
def yields_to(propulsion: float, force: float, cosine: float) -> bool:
    """Tell whether (17) holds: repulsion ``force`` < 0 at ``cosine`` off our direction outweighs ``propulsion``."""
    return propulsion + force * cosine <= 0.0


@jit
def neighbour_weight(error_self: float, error_neighbour: float) -> float:
    """Return the optimal amplitude of f_ai by AdaBoost (21), natural logarithms (readings 11)."""
    return math.log((1.0 - error_neighbour) / error_neighbour) / math.log((1.0 - error_self) / error_self)


@jit
def propulsion(w_a: float, p_s: float) -> float:
    """Return |F_a| (SFM-MAS 6) towards the target from its weight and P_s (7)."""
    return w_a * p_s


@jit
def obstacle_constant(force: float, l_th: float, half_alpha: float) -> float:
    """Return V_0B (SFM-MAS 5) [m^2]: repulsion equals the propulsion ``force`` at ``l_th`` [m] on the sector edge."""
    return l_th * l_th / math.cos(half_alpha) * force


@jit
def obstacle_potential(distance: float, constant: float) -> float:
    """Return V_aB (SFM-MAS 4) [m] at ``distance`` [m] from an obstacle; it rises towards 0 far away."""
    return -constant / distance


@jit
def obstacle_force(distance: float, constant: float) -> float:
    """Return F_aB (SFM-MAS 3, 4) towards the obstacle, so always negative: minus the slope of the potential."""
    return -constant / (distance * distance)

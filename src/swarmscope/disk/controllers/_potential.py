"""The joint potential of the navigation function and its gradient: each formula stands here once.

With V_i the length of robot i's shortest way to its goal, gamma = sum_i s(V_i) and beta the product of one factor
h(gap / range) for every pair of robots and every robot and obstacle, the potential is

    log phi = k log gamma - log beta,    phi = gamma^k / beta.

Lengths are in radii of the workspace. Kernels allocate nothing.
"""

from __future__ import annotations

import math

from swarmscope._jit import jit_inline


@jit_inline
def attraction(way: float, power: float, smooth: float) -> tuple[float, float]:
    """Return s(V) = (V^2 + e^2)^(p/2) - e^p and ds/dV: 0 at the goal only, smooth there, about V^p away from it.

    Args:
        way: V, length of the way to the goal.
        power: p.
        smooth: e > 0.
    """
    square = way * way + smooth * smooth
    if power == 1.0:
        root = math.sqrt(square)
        return root - smooth, way / root
    risen = math.pow(square, 0.5 * power)
    return risen - math.pow(smooth, power), power * way * risen / square


@jit_inline
def obstruction(gap: float, reach: float) -> tuple[float, float]:
    """Return -log h(q) and -d/dgap of that, for q = gap / reach: h = 1 - (1 - q)^3 up to q = 1, 1 beyond (C2).

    The first goes to infinity like -log gap at contact, the second is the push [1 / length], 1 / gap at contact.
    """
    if gap >= reach:
        return 0.0, 0.0
    left = 1.0 - gap / reach
    h = 1.0 - left * left * left
    if h <= 0.0:
        return math.inf, math.inf
    return -math.log(h), 3.0 * left * left / (h * reach)

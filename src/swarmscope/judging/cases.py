"""Cases of convergence and divergence: the choices of a side that neighbours turned round, with their numbers.

A robot's own opinion P_a was on one side of 1/2 and the fused P_dir on the other. *Convergence* (Nav-SCOPE VI-A):
it went to the side of the neighbour that weighed most against its own opinion, because that one sees free space.
*Divergence* (VI-B): it went to the other side, because that neighbour sees obstacles.
"""

from __future__ import annotations

from typing import Any

import numpy as np

MOST_CASES = 3
"""Kept of each kind in one run: those in which the neighbours moved the opinion most."""


def find_cases(choices: np.ndarray, dt: float) -> list[dict[str, Any]]:
    """Return the turned choices among ``choices`` (rows of ``CHOICE``), the strongest of each kind first."""
    heard = choices["heard"] > 0
    turned = heard & ((choices["p_self"] >= 0.5) != (choices["p_left"] >= 0.5))
    turned &= choices["side"] == np.where(choices["p_left"] >= 0.5, 1, -1)  # a loop breaker may overrule
    cases = [_case(row, dt) for row in choices[turned]]
    cases.sort(key=lambda c: -abs(c["p_left"] - c["p_self"]))
    kinds = ("convergence", "divergence")
    return [case for kind in kinds for case in [c for c in cases if c["kind"] == kind][:MOST_CASES]]


CHOICE_COLUMNS = ("tick", "robot", "p_self", "p_left", "side", "heard")
"""Of a choice: when and whose, P_a (9), P_dir (15), +1 left or -1 right, how many neighbours took part."""
OPINION_COLUMNS = ("choice", "heard_id", "heard_side", "heard_p", "heard_f")
"""Of a neighbour's part in one: which row of the choices, whose, on which side it is, its P_ni (14) and f_ai (12)."""


def choices_table(choices: np.ndarray) -> np.ndarray:
    """Return the ``CHOICE_COLUMNS`` of rows of ``CHOICE``, (C, 6) float64."""
    return np.column_stack([choices[name].astype(np.float64) for name in CHOICE_COLUMNS])


def opinions_table(choices: np.ndarray) -> np.ndarray:
    """Return the ``OPINION_COLUMNS`` of every neighbour that took part in one of the ``choices``, (O, 5) float64."""
    choice, k = np.nonzero(np.arange(choices["heard_id"].shape[1]) < choices["heard"][:, None])
    return np.column_stack([choice.astype(np.float64), *(choices[name][choice, k] for name in OPINION_COLUMNS[1:])])


def _case(row: np.void, dt: float) -> dict[str, Any]:
    count, side = int(row["heard"]), int(row["side"])
    neighbours = [
        {
            "id": int(row["heard_id"][k]),
            "side": int(row["heard_side"][k]),
            "p": float(row["heard_p"][k]),
            "f": float(row["heard_f"][k]),
        }
        for k in range(count)
    ]
    pull = [n["f"] * (n["p"] - 0.5) * side for n in neighbours]
    decisive = neighbours[int(np.argmax(pull))]
    return {
        "kind": "convergence" if decisive["side"] == side else "divergence",
        "tick": int(row["tick"]),
        "t_s": float(row["tick"]) * dt,
        "robot": int(row["robot"]),
        "x": float(row["x"]),
        "y": float(row["y"]),
        "target": float(row["target"]),
        "p_self": float(row["p_self"]),
        "p_left": float(row["p_left"]),
        "side": side,
        "decisive": decisive["id"],
        "neighbours": neighbours,
    }

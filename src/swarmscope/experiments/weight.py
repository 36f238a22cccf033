"""w_i from data: how often P_a and P_ni are wrong, and the weight that AdaBoost gives the neighbours for it.

Nav-SCOPE V-C 4: a playground apart from all evaluation worlds, nine samples of the swarm. A choice of a side is
right when it is the side of the shortest way on the true map.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import ConfigError
from swarmscope.experiments.experiment import Experiment, merged, planner_keys
from swarmscope.experiments.seeds import seed_set
from swarmscope.judging.run import play
from swarmscope.judging.statistics import RESAMPLES, Interval, wilson
from swarmscope.onboard.deciding.fields import interaction_force, neighbour_weight
from swarmscope.scenarios.read import parse_scenario

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

    0.245 and 0.446 give 0.193 (printed 0.195, readings 11).
    """
    if not (0.0 < own_error < 1.0 and 0.0 < neighbour_error < 1.0) or own_error == 0.5:
        return math.nan
    return float(neighbour_weight(own_error, neighbour_error))


def count_errors(choices: np.ndarray) -> tuple[int, int, int, int]:
    """Return (own errors, choices, neighbours' errors, opinions) of ``choices`` whose right side is known."""
    known = choices[choices["told_side"] != 0]
    left = known["told_side"] > 0
    own_wrong = int(np.sum((known["p_self"] >= 0.5) != left))
    present = np.arange(known["heard_p"].shape[1])[None, :] < known["heard"][:, None]
    says_left = known["heard_p"] >= 0.5
    return own_wrong, len(known), int(np.sum(present & (says_left != left[:, None]))), int(present.sum())


def estimate_weight(experiment: Experiment) -> WeightResult:
    """Run the swarm samples of ``experiment.weight`` and return the error rates and the weight."""
    asked = experiment.weight
    if asked is None:
        raise ConfigError("weight", "the experiment does not say where to estimate it")
    keys = merged(merged(experiment.scenario, experiment.places[asked.place]), planner_keys(experiment, asked.planner))
    keys = merged(keys, asked.keys)
    seeds = seed_set(asked.seeds)
    counts = []
    for seed in seeds:
        scenario = parse_scenario(keys | {"seed": seed, "record_scans": "no", "judge_sides": True}, "weight")
        outcome = play(scenario, any_angle=False)
        counts.append(count_errors(outcome.trace.choices))
    protection = outcome.setting.rig.protection
    return weight_of(np.array(counts), protection.sigma_a, seeds)


def weight_of(counts: NDArray[np.int64], sigma_a: float, seeds: list[int]) -> WeightResult:
    """Return rates and weight of ``counts`` (S, 4), a row of `count_errors` for each sample of the swarm.

    The interval of the weight is a bootstrap over the samples, because the choices within one are not independent.
    """
    own_wrong, choices, neighbours_wrong, opinions = (int(v) for v in counts.sum(axis=0))
    own, neighbours = wilson(own_wrong, choices), wilson(neighbours_wrong, opinions)
    rng = np.random.default_rng(0)
    picks = counts[rng.integers(0, len(counts), size=(RESAMPLES, len(counts)))].sum(axis=1)
    weights = [adaboost_weight(a / max(1, b), c / max(1, d)) for a, b, c, d in picks]
    finite = np.array(weights)[np.isfinite(weights)]
    low, high = np.quantile(finite, [0.025, 0.975]) if len(finite) else (math.nan, math.nan)
    distances = np.linspace(1.0, 3.0, 2001) * sigma_a
    peak = max(interaction_force(float(d), sigma_a, 1.0) for d in distances)
    weight = adaboost_weight(own.estimate, neighbours.estimate)
    return WeightResult(own, neighbours, weight, float(low), float(high), peak, seeds)

"""A finished run played again, for what its network was given at every choice of a side and how it weighed that."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import InputFileError
from swarmscope.judging.cases import choices_table
from swarmscope.judging.run import judged_setting
from swarmscope.judging.run_folder import TRAJECTORY
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.scenario import Scenario
from swarmscope.sim.loop import Trace, run
from swarmscope.viewing.key_points.attention import Asked, Attention, Listener, attention_of
from swarmscope.viewing.run_data import RunData

Floats = NDArray[np.float64]


class KeyPoint(NamedTuple):
    """A choice of a side by a network with attention."""

    number: int
    """Which of the run's choices it is, from 0."""
    tick: int
    t_s: float
    robot: int
    x: float
    """Where it was [m], world frame."""
    y: float
    target: float
    """Direction of its goal [rad], world frame."""
    heard: tuple[int, ...]
    """Who had answered."""
    weights: Floats
    """(1 + heard, H): attention (6) of each head, to the robot itself first."""
    gains: Floats
    """(heard,): beta (8), which (9) adds to the weight of each."""
    logits: Floats
    """(2,): outputs of the network, left and right."""
    p_left: float
    """Their softmax, as the planner used it."""
    p_self: float
    """What it would have said with nobody heard."""
    side: int
    """Taken: +1 left, -1 right."""
    true_side: int
    """Of the shortest way on the true map, 0 where it has none."""

    @property
    def weight(self) -> Floats:
        """Attention to the robot itself and to each that it heard, mean of the heads; the sum is 1."""
        found: Floats = self.weights.mean(axis=1)
        return found

    @property
    def outputs(self) -> tuple[float, float]:
        """Both softmax outputs: left, right."""
        return self.p_left, 1.0 - self.p_left


def key_points(found: RunData, scenario: Scenario) -> list[KeyPoint]:
    """Return every choice that the network made in a finished run of ``scenario``, in their order.

    An InputFileError says that the run no longer comes out as it did.
    """
    judged = scenario.model_copy(update={"judge_sides": True, "record_scans": "no"})
    setting = judged_setting(judged, make_setup(judged))
    attention = attention_of(setting.planner.name, setting.planner.model)
    listener = Listener(setting.planner.model.network)
    listening = replace(setting.planner, model=SimpleNamespace(network=listener))

    def sensed(_: object, tick: int) -> None:
        listener.tick = tick

    trace = run(replace(setting, planner=listening), sensed=sensed)
    if not np.array_equal(choices_table(trace.choices), found.trajectory.choices, equal_nan=True):
        raise InputFileError(
            found.folder / TRAJECTORY,
            "the run no longer comes out the same: the program, the machine, a map or the network is another one",
        )
    return _matched(trace, listener.asked, attention)


def _matched(trace: Trace, asked: list[Asked], attention: Attention) -> list[KeyPoint]:
    """Return the choices for which the network was asked; sides that are tossed for after a loop are no such."""
    found, waiting = [], list(asked)
    for number, choice in enumerate(trace.choices):
        wanted = choice["tick"], choice["p_left"], choice["heard"] + 1
        # Of two that are alike the first is meant: in a tick robots are asked for in the order of their choices.
        at = next((k for k, one in enumerate(waiting) if (one.tick, one.p_left, len(one.cells)) == wanted), None)
        if at is not None:
            found.append(_key_point(number, choice, float(trace.t_s[choice["tick"]]), waiting.pop(at), attention))
    return found


def _key_point(number: int, choice: np.void, t_s: float, asked: Asked, attention: Attention) -> KeyPoint:
    weighed, n = attention.of(asked), int(choice["heard"])
    return KeyPoint(
        number=number,
        tick=int(choice["tick"]),
        t_s=t_s,
        robot=int(choice["robot"]),
        x=float(choice["x"]),
        y=float(choice["y"]),
        target=float(choice["target"]),
        heard=tuple(choice["heard_id"][:n].tolist()),
        weights=weighed.weights,
        gains=choice["heard_f"][:n].copy(),
        logits=weighed.logits,
        p_left=float(choice["p_left"]),
        p_self=float(choice["p_self"]),
        side=int(choice["side"]),
        true_side=int(choice["told_side"]),
    )

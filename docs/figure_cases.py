"""SFM-MAS Figs. 5 and 6 from our own runs: ways that draw together, and choices that neighbours turned round."""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from figure_style import BLUE, GREEN, GREY, INK, ORANGE
from figure_worlds import (
    PURPLE,
    WAY,
    Keys,
    draw_marks,
    draw_ways,
    draw_world,
    legend_of_marks,
    marks_of,
    played,
    words_of,
)
from matplotlib.patches import Circle

from swarmscope.held import Held
from swarmscope.judging.cases import find_cases
from swarmscope.judging.run import Outcome, Watch
from swarmscope.onboard.perception.features import align_features, reconstruct
from swarmscope.onboard.sharing.feature_message import FeatureMessage, PacketError
from swarmscope.sim.state import Sim

PLACES = {"forest": "trees", "rocky": "rocks"}
"""Places of SFM-MAS V, and what stands there."""
PLANNERS = {"DH-Bug": "dh-bug", "SFM-I": "sfm-i", "SFM-MAS": "sfm-mas"}
RANGE_M = 5.0
MAP_SEED = 0
TOGETHER_M = 0.45
"""Ways that come so near one another, half of sigma_a, run together there."""
STEP_M = 0.1


def keys_of(place: str, planner: str, density: float) -> Keys:
    """Return a scenario of SFM-MAS V: ``density`` obstacles per m², 5.5 Hz, the planner as printed."""
    task = {"name": "T1", "options": {"density": density, "obstacles": PLACES[place]}}
    return {
        "task": task,
        "planner": {"name": planner, "preset": "printed"},
        "lidar": {"rate_hz": 5.5, "range_m": RANGE_M},
    }


def along(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return points every ``STEP_M`` along a way (K, 2) [m]."""
    travelled = np.append(0.0, np.cumsum(np.hypot(np.diff(x), np.diff(y))))
    at = np.arange(0.0, travelled[-1], STEP_M)
    return np.column_stack([np.interp(at, travelled, x), np.interp(at, travelled, y)])


def together(outcome: Outcome) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return of each robot its way (K, 2) [m] and where another one's runs within ``TOGETHER_M`` of it (K,)."""
    records = outcome.trace.records
    ways = [along(records.x[:, i], records.y[:, i]) for i in range(records.x.shape[1])]
    found = []
    for i, way in enumerate(ways):
        others = np.concatenate([other for j, other in enumerate(ways) if j != i])
        gaps = np.hypot(*(way[:, None] - others[None]).transpose(2, 0, 1)).min(axis=1)
        found.append((way, gaps <= TOGETHER_M))
    return found


def share_together(outcome: Outcome) -> float:
    """Return the share of all ways that runs along another robot's."""
    near = np.concatenate([shared for _, shared in together(outcome)])
    return float(near.mean())


@cache
def map_runs() -> dict[tuple[str, str], Outcome]:
    """Run the printed planners on one map of each place."""
    return {
        (place, label): played(keys_of(place, name, 0.2), MAP_SEED)
        for place in PLACES
        for label, name in PLANNERS.items()
    }


def convergence() -> plt.Figure:
    """Draw the ways of all three planners in a forest and among rocks, and where they run together (SFM-MAS Fig. 5)."""
    runs = map_runs()
    figure, rows = plt.subplots(2, 3, figsize=(13.6, 9.8), layout="constrained")
    for row, place in zip(rows, PLACES, strict=True):
        for ax, label in zip(row, PLANNERS, strict=True):
            outcome = runs[place, label]
            marks = marks_of(outcome)
            draw_world(ax, outcome)
            draw_ways(ax, outcome)
            for way, near in together(outcome):
                ax.plot(*np.where(near[:, None], way, np.nan).T, color=GREEN, lw=3.2, alpha=0.45, zorder=2)
            draw_marks(ax, outcome, marks)
            words = words_of(outcome, marks)
            ax.set_title(f"{label}, {place}: {words}, {100 * share_together(outcome):.0f} % together", fontsize=9.5)
    band = plt.Line2D([], [], color=GREEN, lw=3.2, alpha=0.45, label="along another's way")
    figure.legend(handles=[band, *legend_of_marks("(27)")], loc="outside lower center", ncols=6, frameon=False)
    return figure


class Shown(NamedTuple):
    """A turned choice that is drawn: where it is found, and who is A, B and C of the print."""

    place: str
    density: float
    seed: int
    robot: int
    follower_of: int
    """B: the neighbour on the side that A would have taken alone."""
    goes_to: int
    """C: one on the side that it takes."""


SHOWN = (Shown("forest", 0.35, 1053, 3, 5, 2), Shown("rocky", 0.2, 50020, 12, 11, 13))
"""Found among the tuning seeds: divergences in which B and C are on different sides and both speak for C's."""
MOMENTS_S = (-4.0, 0.0, 6.0)
"""What is shown of a case, from the choice on."""


class Case(NamedTuple):
    """A turned choice with what its robot had been told."""

    shown: Shown
    outcome: Outcome
    case: dict[str, Any]
    """As `judging/cases.py` gives it."""
    heard: dict[int, FeatureMessage]
    """The features of each neighbour that took part."""
    told: int
    """Side of the shortest way, +1 left, -1 right, 0 none."""


@cache
def case_of(shown: Shown) -> Case:
    """Run the world of a case; keep the features that its robot had heard by then."""
    keys = keys_of(shown.place, "sfm-mas", shown.density)
    log: list[tuple[int, FeatureMessage]] = []

    def between(held: Held[Sim], tick: int) -> bool:
        percept = held.what.percepts[shown.robot]
        for k in range(percept["n_packets"]):
            packet = percept["packet"][k, : percept["packet_length"][k]].tobytes()
            try:
                log.append((tick, FeatureMessage.unpack(packet, RANGE_M)))
            except PacketError:
                continue  # a request
        return False

    outcome = played(keys, shown.seed, True, Watch(between=between))
    choices = outcome.trace.choices
    (case,) = (
        case
        for case in find_cases(choices, outcome.setting.dt)
        if case["robot"] == shown.robot and case["kind"] == "divergence"
    )
    heard = {message.sender: message for tick, message in log if tick <= case["tick"]}
    (row,) = choices[(choices["tick"] == case["tick"]) & (choices["robot"] == case["robot"])]
    spoke = {n["id"]: heard[n["id"]] for n in case["neighbours"]}
    return Case(shown, outcome, case, spoke, int(row["told_side"]))


def aligned(message: FeatureMessage, target: float) -> tuple[np.ndarray, np.ndarray, int]:
    """Return features in the frame of a ``target`` direction [rad], as the kernels take them; distances in m."""
    n = len(message.angles)
    angles, distances = np.zeros(n), np.zeros(n)
    align_features(np.array(message.angles), np.array(message.distances), n, -target, angles, distances)
    return angles, distances, n


def outline(message: FeatureMessage, x: float, y: float) -> np.ndarray:
    """Return the polygon (361, 2) [m] that a receiver makes of features of a robot at (x, y), world frame."""
    features = aligned(message, 0.0)
    phi = np.linspace(0.0, 2.0 * math.pi, 361)
    d = np.array([reconstruct(*features, float(p % (2.0 * math.pi)), True) for p in phi])
    return np.column_stack([x + d * np.cos(phi), y + d * np.sin(phi)])


def divergence() -> plt.Figure:
    """Draw two divergences from their ways to the moments of each (SFM-MAS Fig. 6), with the numbers of the fusion."""
    figure, rows = plt.subplots(2, 5, figsize=(16.0, 7.4), width_ratios=(1, 1, 1, 1, 0.62), layout="constrained")
    for row, shown in zip(rows, SHOWN, strict=True):
        case = case_of(shown)
        window = window_of(case)
        _draw_moment(row[0], case, None, window)
        row[0].set_title(f"{shown.place}, seed {shown.seed}: the whole ways", fontsize=10.5)
        for ax, after in zip(row[1:4], MOMENTS_S, strict=True):
            _draw_moment(ax, case, after, window)
            ax.set_title(f"{case.case['t_s'] + after:.1f} s{': A chooses' if after == 0 else ''}", fontsize=10.5)
        row[4].axis("off")
        row[4].text(0.0, 0.98, numbers_of(case), fontsize=9.5, va="top", linespacing=1.5, transform=row[4].transAxes)
    return figure


def window_of(case: Case) -> tuple[float, float, float, float]:
    """Return what is shown round a case: x0, x1, y0, y1 [m]."""
    x, y = case.case["x"], case.case["y"]
    return x - 3.2, x + 5.2, y - 4.2, y + 4.2


def letter_of(case: Case, robot: int) -> str:
    """Return the print's letter of a robot, or its number."""
    shown = case.shown
    return {shown.robot: "A", shown.follower_of: "B", shown.goes_to: "C"}.get(robot, str(robot))


def numbers_of(case: Case) -> str:
    """Return P_a, each neighbour's P_ni and f_ai, and P_dir in lines of text."""
    found = case.case
    lines = ["A alone:", f"  $P_a$ = {found['p_self']:.3f}, {_side(1 if found['p_self'] >= 0.5 else -1)}"]
    for n in found["neighbours"]:
        lines += [f"{letter_of(case, n['id'])}, on the {_side(n['side'])}:"]
        lines += [f"  $P_{{ni}}$ = {n['p']:.3f}, $f_{{ai}}$ = {n['f']:.3f}"]
    lines += ["fused:", f"  $P_{{dir}}$ = {found['p_left']:.3f}, {_side(found['side'])}"]
    return "\n".join([*lines, f"shortest way: {_side(case.told)}"])


def _side(side: int) -> str:
    return {1: "left", -1: "right"}.get(side, "none")


def _draw_moment(ax: plt.Axes, case: Case, after: float | None, window: tuple[float, float, float, float]) -> None:
    """Draw the place ``after`` so many seconds from the choice, or the whole ways."""
    outcome, records = case.outcome, case.outcome.trace.records
    draw_world(ax, outcome)
    ax.set(xlim=window[:2], ylim=window[2:])
    last = len(records.x) - 1
    tick = last if after is None else min(last, case.case["tick"] + round(after / outcome.setting.dt))
    if after == 0:
        _draw_heard(ax, case)
    for i in range(records.x.shape[1]):
        colour, lead = _colour(case, i)
        ax.plot(records.x[: tick + 1, i], records.y[: tick + 1, i], color=colour, lw=1.8 if lead else 0.9, zorder=3)
        at = (records.x[tick, i], records.y[tick, i])
        if after is None or not (window[0] < at[0] < window[1] and window[2] < at[1] < window[3]):
            continue
        ax.add_patch(Circle(at, outcome.scenario.widest.radius_m, fc=colour, ec="white", lw=0.8, zorder=6))
        name = letter_of(case, i)
        ax.annotate(name, at, (0, 9), textcoords="offset points", ha="center", color=INK, fontsize=10, zorder=9)
    if after is None:
        ax.plot(*outcome.setup.goals.T, "o", ms=4.5, mfc="white", mec=WAY, mew=0.9, ls="", zorder=4)
        ax.plot(case.case["x"], case.case["y"], "D", ms=8, color=INK, mec="white", zorder=8)


def _colour(case: Case, robot: int) -> tuple[str, bool]:
    letter = letter_of(case, robot)
    other = PURPLE if robot in case.heard else WAY
    return {"A": BLUE, "B": ORANGE, "C": GREEN}.get(letter, other), letter in "ABC"


def _draw_heard(ax: plt.Axes, case: Case) -> None:
    """Draw what A has heard: the polygons of its neighbours' features; and the directions before and after."""
    records, found = case.outcome.trace.records, case.case
    for neighbour, message in case.heard.items():
        colour, _ = _colour(case, neighbour)
        x, y = records.x[found["tick"], neighbour], records.y[found["tick"], neighbour]
        polygon = outline(message, float(x), float(y))
        ax.fill(*polygon.T, color=colour, alpha=0.10, lw=0, zorder=1)
        ax.plot(*polygon.T, color=colour, lw=1.0, alpha=0.8, zorder=2)
        angles, distances = np.array(message.angles), np.array(message.distances)
        ax.plot(x + distances * np.cos(angles), y + distances * np.sin(angles), "o", color=colour, ms=4, zorder=4)
    arrow: dict[str, Any] = {"arrowstyle": "-|>", "lw": 1.8, "shrinkA": 0, "shrinkB": 0}
    for turn, colour, dashes in ((0.0, GREY, "-"), (-0.9, BLUE, (0, (3, 2))), (0.9, BLUE, "-")):
        angle = found["target"] + turn * found["side"]
        tip = (found["x"] + 1.2 * math.cos(angle), found["y"] + 1.2 * math.sin(angle))
        ax.annotate("", tip, (found["x"], found["y"]), arrowprops=arrow | {"color": colour, "ls": dashes}, zorder=7)

"""The worlds of docs/theory.md with what robots did in them: ways, choices of a side, waits; all in m, world frame."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from figure_style import BLUE, GREEN, GREY, INK, ORANGE, RED
from matplotlib.lines import Line2D
from matplotlib.markers import MarkerStyle
from matplotlib.transforms import Affine2D

from swarmscope.experiments.experiment import Experiment, load_experiment, merged, planner_keys, shipped_experiment
from swarmscope.experiments.seeds import seed_set
from swarmscope.experiments.weight import NEIGHBOUR_PRINTED, SELF_PRINTED, WeightResult, count_errors, weight_of
from swarmscope.judging.cases import find_cases
from swarmscope.judging.run import NOBODY, Outcome, Watch, figures, play
from swarmscope.onboard.reasons import YIELD
from swarmscope.scenarios.read import parse_scenario
from swarmscope.viewing.pictures import draw_obstacles

Keys = dict[str, Any]
WAY, TURNED = "#8a97a3", {"convergence": BLUE, "divergence": ORANGE}
"""Colours of ways, and of choices that neighbours turned round."""
PURPLE = "#8e3f9e"
PLAYGROUND_SAMPLE = 0
"""Which of the nine samples is drawn."""
FOREST_SEED = 11
"""Of the set paper-size the seed whose γ of Nav-SCOPE as printed, mean over T1 to T3, is the (lower) median."""
WAIT_GAP_S = 2.0
"""A robot that waits again so soon still waits."""
TASKS = ("T1", "T2", "T3")
PLANNERS = {"Nav-I": "nav-i", "Nav-SCOPE": "nav-scope"}


def played(keys: Keys, seed: int, judge: bool = False, watch: Watch = NOBODY) -> Outcome:
    """Run a scenario for its picture; ``judge`` notes the side of the shortest way beside every choice."""
    scenario = parse_scenario(keys | {"seed": seed, "record_scans": "no", "judge_sides": judge}, "figure")
    return play(scenario, any_angle=False, watch=watch)


class Playground(NamedTuple):
    """The nine samples of the swarm from which w_i is estimated (Nav-SCOPE V-C 4)."""

    seeds: list[int]
    shown: Outcome
    counts: np.ndarray
    """(9, 4): own errors, choices, neighbours' errors, opinions (`count_errors`)."""
    weight: WeightResult


@cache
def playground_samples() -> Playground:
    """Run what the experiment ``nav-scope`` says of the weight, our own bias b_0 = 0."""
    experiment = load_experiment(shipped_experiment("nav-scope"))
    seeds, keys = seed_set(experiment.weight.seeds), _weight_keys(experiment)
    outcomes = [played(keys, seed, judge=True) for seed in seeds]
    counts = np.array([count_errors(outcome.trace.choices) for outcome in outcomes])
    weight = weight_of(counts, outcomes[0].setting.rig.protection.sigma_a, seeds)
    return Playground(seeds, outcomes[PLAYGROUND_SAMPLE], counts, weight)


def _weight_keys(experiment: Experiment) -> Keys:
    asked = experiment.weight
    keys = merged(experiment.scenario, experiment.places[asked.place])
    return merged(merged(keys, planner_keys(experiment, asked.planner)), asked.keys)


def playground() -> plt.Figure:
    """Draw one sample with every choice right or wrong, and the error rates [%] of all nine."""
    samples = playground_samples()
    figure, (left, right) = plt.subplots(1, 2, figsize=(12.6, 7.0), width_ratios=(2.0, 1.0))
    draw_world(left, samples.shown)
    draw_ways(left, samples.shown)
    for choice in samples.shown.trace.choices:
        told = int(choice["told_side"])
        own = 1 if choice["p_self"] >= 0.5 else -1
        colour = GREY if told == 0 else GREEN if told == own else RED
        mark_side(left, choice, own, colour, 9.0)
    wrong, known = samples.counts[PLAYGROUND_SAMPLE][:2]
    left.set_title(f"sample {samples.seeds[PLAYGROUND_SAMPLE]}: {wrong} of {known} choices wrong", fontsize=10.5)
    names = {GREEN: "$P_a$ on the side of the shortest way", RED: "on the other side"}
    if (samples.shown.trace.choices["told_side"] == 0).any():
        names[GREY] = "no obstacle within sight on the shortest way"
    handles = [Line2D([], [], color=colour, marker="^", ls="", label=name) for colour, name in names.items()]
    left.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.01), ncols=len(names), frameon=False)
    _draw_rates(right, samples)
    figure.tight_layout()
    return figure


def _draw_rates(ax: plt.Axes, samples: Playground) -> None:
    """Draw error rates [%] of P_a and P_ni in each sample, over all, and as printed (dashed)."""
    own_wrong, choices, heard_wrong, opinions = samples.counts.T
    columns = (
        (0, own_wrong / choices, samples.weight.own, SELF_PRINTED, BLUE, "$P_a$"),
        (1, heard_wrong / opinions, samples.weight.neighbours, NEIGHBOUR_PRINTED, ORANGE, "$P_{ni}$"),
    )
    spread = np.linspace(-0.18, 0.18, len(samples.seeds))
    for at, rates, pooled, printed, colour, _ in columns:
        ax.plot(at + spread, 100 * rates, "o", color=colour, alpha=0.6, ms=6)
        ax.hlines(100 * pooled.estimate, at - 0.32, at + 0.32, color=colour, lw=2.4)
        ax.hlines(100 * printed, at - 0.32, at + 0.32, color=INK, lw=1.4, ls="--")
        ax.text(
            at + 0.34, 100 * pooled.estimate, f"{100 * pooled.estimate:.1f}", color=colour, va="center", fontsize=9.5
        )
        ax.text(at + 0.34, 100 * printed, f"{100 * printed:.1f}", color=INK, va="center", fontsize=9.5)
    ax.axhline(50, color=GREY, lw=0.9, ls=":")
    ax.text(-0.55, 50.6, "a coin", color=GREY, fontsize=9)
    ax.set_xticks([0, 1], [f"{name}\n{int(n.sum())} {what}" for (*_, name), n, what in
                           zip(columns, (choices, opinions), ("choices", "opinions"), strict=True)])  # fmt: skip
    ax.set(xlim=(-0.6, 1.65), ylim=(0, 70), title="wrong in each of the nine samples [%]")
    ax.title.set_fontsize(10.5)
    lines = [
        Line2D([], [], color=GREY, lw=2.4, label="over all nine"),
        Line2D([], [], color=INK, lw=1.4, ls="--", label="printed"),
    ]
    ax.legend(handles=lines, loc="lower right", frameon=False)


def draw_world(ax: plt.Axes, outcome: Outcome) -> None:
    """Draw what stands in the world and lay the panel out round it and all ways."""
    draw_obstacles(ax, outcome.setup.world.obstacles)
    records, goals, bounds = outcome.trace.records, outcome.setup.goals, outcome.setting.bounds
    xs, ys = np.append(records.x, goals[:, 0]), np.append(records.y, goals[:, 1])
    ax.set_xlim(min(bounds[0], xs.min() - 0.3), max(bounds[2], xs.max() + 0.3))
    ax.set_ylim(min(bounds[1], ys.min() - 0.3), max(bounds[3], ys.max() + 0.3))
    ax.set_aspect("equal")
    ax.set_xticks([])
    ax.set_yticks([])
    ax.grid(False)
    for spine in ax.spines.values():
        spine.set(visible=True, color="#c4c9cd", linewidth=0.6)


def draw_ways(ax: plt.Axes, outcome: Outcome, colour: str = WAY) -> None:
    """Draw ways, starts (dots) and goals (rings); red with a cross who did not arrive or touched something."""
    records, robots = outcome.trace.records, outcome.trace.robots
    lost = ~np.isfinite(robots["arrival_s"]) | robots["crashed"].astype(bool)
    for i in range(len(robots)):
        tint = RED if lost[i] else colour
        ax.plot(records.x[:, i], records.y[:, i], color=tint, lw=1.1, zorder=3)
        ax.plot(*outcome.setup.starts[i, :2], "o", ms=3, color=tint, zorder=4)
        ax.plot(*outcome.setup.goals[i], "o", ms=4.5, mfc="white", mec=tint, mew=0.9, zorder=4)
        if lost[i]:
            ax.plot(robots["x"][i], robots["y"][i], "X", ms=8, color=RED, mec="white", mew=0.7, zorder=8)


def mark_side(ax: plt.Axes, choice: np.void, side: int, colour: str, size: float) -> None:
    """Mark a choice of a side with a triangle that points there, across the direction of the target."""
    turn = float(choice["target"]) + side * 0.5 * np.pi
    marker = MarkerStyle("^", transform=Affine2D().rotate(turn - 0.5 * np.pi))
    ax.plot(choice["x"], choice["y"], marker=marker, ms=size, color=colour, mec="white", mew=0.5, ls="", zorder=6)


class Marks(NamedTuple):
    """What is marked in one run."""

    kinds: list[str]
    """Of each choice: ``convergence``, ``divergence``, or nothing where no neighbour turned it round."""
    waits: np.ndarray
    """(W, 2) where a robot began to wait by (17) or (27)."""


def marks_of(outcome: Outcome) -> Marks:
    """Return which choices neighbours turned round, and where waits began."""
    choices, records = outcome.trace.choices, outcome.trace.records
    again = round(WAIT_GAP_S / outcome.setting.dt)
    found = [find_cases(choices[k : k + 1], outcome.setting.dt) for k in range(len(choices))]
    waits = records.state == YIELD
    begun = waits.copy()
    for k in range(1, again + 1):
        begun[k:] &= ~waits[:-k]
    return Marks(
        [cases[0]["kind"] if cases else "" for cases in found], np.array([records.x[begun], records.y[begun]]).T
    )


def draw_marks(ax: plt.Axes, outcome: Outcome, marks: Marks) -> None:
    """Draw choices (small where nobody turned them round) and waits."""
    for choice, kind in zip(outcome.trace.choices, marks.kinds, strict=True):
        mark_side(ax, choice, int(choice["side"]), TURNED.get(kind, INK), 9.5 if kind else 4.5)
    if len(marks.waits):
        ax.plot(*marks.waits.T, "s", ms=6.5, mfc="none", mec=PURPLE, mew=1.4, ls="", zorder=7)


def legend_of_marks(rule: str) -> list[Line2D]:
    """Return the entries for what `draw_marks` and `draw_ways` draw; ``rule`` is the waits' equation."""
    return [
        Line2D([], [], color=INK, marker="^", ms=5, ls="", label="side chosen"),
        Line2D([], [], color=BLUE, marker="^", ms=9, ls="", label="turned round: convergence"),
        Line2D([], [], color=ORANGE, marker="^", ms=9, ls="", label="turned round: divergence"),
        Line2D([], [], color=PURPLE, marker="s", mfc="none", ms=6, ls="", label=f"began to wait by {rule}"),
        Line2D([], [], color=RED, marker="X", ms=8, label="did not arrive, or touched something"),
    ]


def words_of(outcome: Outcome, marks: Marks) -> str:
    """Return a run's figures in a line: redundancy, arrivals, choices and what became of them, waits."""
    values, arrived = figures(outcome), np.isfinite(outcome.trace.robots["arrival_s"])
    gamma = values["path_redundancy"]
    redundancy = "–" if gamma is None else f"{100 * gamma:.1f} %".replace("-", "−")
    turned = [marks.kinds.count(kind) for kind in TURNED]
    return (
        f"γ {redundancy}, {arrived.sum()} of {arrived.size} arrive, "
        f"choices: {len(marks.kinds)},\n"
        f"convergences: {turned[0]}, divergences: {turned[1]}, waits: {len(marks.waits)}"
    )


@cache
def printed_runs() -> dict[tuple[str, str], Outcome]:
    """Run Nav-I and Nav-SCOPE with the preset of the print, T1 to T3, in one forest."""
    return {
        (label, task): played({"task": {"name": task}, "planner": {"name": name, "preset": "printed"}}, FOREST_SEED)
        for label, name in PLANNERS.items()
        for task in TASKS
    }


def paths() -> plt.Figure:
    """Draw the ways of the printed planners with what decided them (Nav-SCOPE Fig. 6)."""
    runs = printed_runs()
    figure, rows = plt.subplots(2, 3, figsize=(13.6, 9.8), layout="constrained")
    for row, label in zip(rows, PLANNERS, strict=True):
        for ax, task in zip(row, TASKS, strict=True):
            outcome = runs[label, task]
            marks = marks_of(outcome)
            draw_world(ax, outcome)
            draw_ways(ax, outcome)
            draw_marks(ax, outcome, marks)
            ax.set_title(f"{label}, {task}: {words_of(outcome, marks)}", fontsize=9.5)
    figure.legend(handles=legend_of_marks("(17)"), loc="outside lower center", ncols=5, frameon=False)
    return figure

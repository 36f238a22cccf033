"""The grid of paths: one row per place, one column per planner, all in the same world (Nav-SCOPE Fig. 6)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from swarmscope.experiments.results import Run
from swarmscope.viewing.colours import CRASH, FAINT
from swarmscope.viewing.report import words
from swarmscope.viewing.report.again import Again, Played
from swarmscope.viewing.report.blocks import Picture
from swarmscope.viewing.report.drawing import FRAME, PAPER, draw_world, new_figure, picture
from swarmscope.viewing.report.material import ALL, Material

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MANY = 60
"""With more robots than this their lines are thinner."""
MANY_PLANNERS = 6
"""With more planners than this their names stand above the figures of their runs."""


def median_seed(material: Material) -> int | None:
    """Return the seed whose gamma of ours, mean over the places, is the median; the lower one of two."""
    gammas: dict[int, list[float]] = {}
    for run in material.of(ALL, material.leading()):
        gamma = run.figures.get("path_redundancy")
        gammas.setdefault(run.seed, []).append(np.nan if gamma is None else gamma)
    most = max((len(values) for values in gammas.values()), default=0)
    full = {seed: float(np.mean(values)) for seed, values in gammas.items() if len(values) == most}
    known = sorted((gamma, seed) for seed, gamma in full.items() if np.isfinite(gamma))
    if known:
        return known[(len(known) - 1) // 2][1]
    return min((run.seed for run in material.main_runs()), default=None)


def path_picture(material: Material, again: Again, progress: Callable[[str], None]) -> Picture | None:
    """Return the grid of paths of the median seed; None without runs."""
    seed = median_seed(material)
    runs = {(run.place, run.planner): run for run in material.main_runs() if run.seed == seed}
    planners = [p for p in material.planners if any(planner == p for _, planner in runs)]
    places = [p for p in material.places if any(place == p for place, _ in runs)]
    if not runs:
        return None
    progress(f"paths of seed {seed}")
    played = {key: again.of(run) for key, run in runs.items()}
    shapes = [_shape(next(p for (name, _), p in played.items() if name == place)) for place in places]
    width = max(1.6, min(3.4, 10.6 / len(planners)))
    figure = new_figure(0.5 + width * len(planners), 0.35 + sum(width * shape + 0.25 for shape in shapes))
    panels = figure.subplots(len(places), len(planners), squeeze=False, height_ratios=shapes)
    for k, (row, place) in enumerate(zip(panels, places, strict=True)):
        for axes, planner in zip(row, planners, strict=True):
            _panel(axes, played.get((place, planner)), material.colour(planner), 0.75 if len(planners) > 3 else 1.0)
            if (place, planner) in runs:
                axes.set_title(_figures(runs[place, planner]), fontsize=7.5, color=FAINT, loc="right", pad=3)
            if axes is row[0]:
                axes.set_ylabel(place, fontsize=11, rotation=0, ha="right", va="center", labelpad=8)
            if k == 0:
                name = f"{planner}\n" if len(planners) > MANY_PLANNERS else planner
                axes.set_title(name, loc="left", fontsize=10.5, fontweight="bold", color=material.colour(planner))
    lost = sum(int(np.sum(~p.arrived)) for p in played.values())
    caption = (
        f"Paths of all robots, seed {seed}: rows are places, columns planners, every row one world. It is the seed "
        f"whose γ of {material.leading()} is the median. Dots: starts, rings: goals. "
        + ("Red with a cross: robots that did not arrive" if lost else "Every robot of these runs arrived")
        + ". Above each: γ and robots that arrived."
    )
    return picture(figure, "paths", caption, "Paths of all robots for each planner and place")


def _shape(played: Played) -> float:
    """Return height over width of a world, within what a panel can be."""
    x0, y0, x1, y1 = played.world.bounds
    return min(2.5, max(0.3, (y1 - y0) / (x1 - x0)))


def _panel(axes: Axes, played: Played | None, colour: str, thin: float) -> None:
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set(visible=played is not None, color=FRAME, linewidth=0.6)
    if played is None:
        axes.text(0.5, 0.5, "not run", transform=axes.transAxes, ha="center", color=FAINT)
        return
    frame(axes, played)
    draw_world(axes, played.world.obstacles)
    thin *= 0.5 if played.x.shape[1] > MANY else 1.0
    for i in range(played.x.shape[1]):
        good = bool(played.arrived[i])
        tint = colour if good else CRASH
        axes.plot(
            played.x[:, i], played.y[:, i], color=tint, lw=thin if good else 1.4 * thin, zorder=3 if good else 3.5
        )
        axes.plot(*played.starts[i, :2], "o", ms=2.6 * thin, color=tint, zorder=4)
        axes.plot(*played.goals[i], "o", ms=4.0 * thin, mfc=PAPER, mec=tint, mew=0.8, zorder=4)
        if not good:
            end = played.x[-1, i], played.y[-1, i]
            axes.plot(*end, "X", ms=7.5 * thin, color=CRASH, mec=PAPER, mew=0.7, zorder=5)


def frame(axes: Axes, played: Played) -> None:
    """Show all of the world and everywhere a robot was, to scale."""
    x0, y0, x1, y1 = played.world.bounds
    margin = 2.0 * played.radius
    xs = np.concatenate([played.x.ravel(), played.goals[:, 0]])
    ys = np.concatenate([played.y.ravel(), played.goals[:, 1]])
    axes.set_xlim(min(x0, float(np.nanmin(xs)) - margin), max(x1, float(np.nanmax(xs)) + margin))
    axes.set_ylim(min(y0, float(np.nanmin(ys)) - margin), max(y1, float(np.nanmax(ys)) + margin))
    axes.set_aspect("equal")


def _figures(run: Run) -> str:
    arrived = int(np.isfinite(run.arrival_s).sum())
    gamma = words.value("path_redundancy", run.figures.get("path_redundancy"))
    return f"γ {gamma}   {arrived}/{len(run.arrival_s)}"

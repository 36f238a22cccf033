"""Pictures of the unit disk: paths of a run, clearance over time, one robot's field, the report's repulsion."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from swarmscope.disk import bounds, geodesic
from swarmscope.disk.controllers import report
from swarmscope.disk.maps import DiskMap
from swarmscope.disk.rules import Floats, goals
from swarmscope.disk.runs import COLLISIONS, STATUS_WORDS, Film, Outcome, Problem
from swarmscope.disk.stalls import (
    CIRCLES,
    TOUCHES,
    Basins,
    Situation,
    has_potential,
    paths,
    potential_on_grid,
)
from swarmscope.lettering import drawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK, FAINT, GROUND = "#2b333b", "#7b8590", "#fbfaf7"
SOLID, SOLID_EDGE = "#c9d2c4", "#a4b19d"
CRASH = "#c23b22"
ROBOTS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b8860b", "#56b4e9", "#5b5b5b", "#7a3ea8", "#8c510a", "#1b7837")
"""Colours that stay apart for colour-blind people; robot k has the same in every picture and page."""
MANY = 20
"""More robots than that are drawn thinner and without their shortest ways."""
TRACE_STEP = 0.004
LEVELS, POTENTIAL_POINTS = 22, 121
PLAIN = "{x:g}"
"""How numbers stand beside logarithmic axes: matplotlib writes powers as formulas, which are off in ``drawing``."""
GAPS = (1e-6, 0.05)
"""Smallest and largest gap in the picture of the repulsion [radii of the disk]."""
FARTHEST = 2.0
"""No goal in the disk is farther away, so no attraction is longer."""
STUCK, ROUND_AND_ROUND, TOUCHING = "#d55e00", "#cc79a7", "#7a3ea8"


def robot_colour(k: int) -> str:
    """Return the colour of robot k."""
    return ROBOTS[k % len(ROBOTS)]


def trajectories_png(of: Problem, b: int, outcome: Outcome, film: Film, label: str, bound: int) -> bytes:
    """Return the paths of run b as PNG, over the shortest ways of robots that are alone."""

    def draw(figure: Any) -> None:
        axes = figure.add_axes((0.02, 0.02, 0.96, 0.87))
        _draw_paths(axes, of, b, outcome, film)
        _title(figure, f"{label} on {of.maps[of.map_of[b]].name}", _run_words(of, b, outcome, bound))

    return _png(draw, (7.2, 7.9))


def paths_side_by_side_png(of: Problem, b: int, runs: Sequence[tuple[str, Outcome, Film]], bound: int) -> bytes:
    """Return the same run by several controllers, side by side."""

    def draw(figure: Any) -> None:
        for k, (label, outcome, film) in enumerate(runs):
            axes = figure.add_axes(((k + 0.02) / len(runs), 0.02, 0.96 / len(runs), 0.84))
            _draw_paths(axes, of, b, outcome, film)
            words = STATUS_WORDS[outcome.status[b]]
            axes.set_title(f"{label}: {words}, {outcome.steps[b]} steps", fontsize=11, color=INK, loc="left")
        name, permutation = of.maps[of.map_of[b]].name, _permutation_words(of, b)
        title = f"{name}, {permutation}; bound {bound} steps"
        figure.text(0.012, 0.95, title, fontsize=12, color=INK, weight="bold")

    return _png(draw, (5.2 * len(runs), 6.0))


def _draw_paths(axes: Axes, of: Problem, b: int, outcome: Outcome, film: Film) -> None:
    rules, place = of.rules, of.maps[of.map_of[b]]
    _draw_place(axes, place, rules.r)
    where = np.array([picture[b] for picture in film.positions])
    thin = 1.6 if rules.n <= MANY else 0.7
    for k, way in enumerate(_shortest_ways(of, b) if rules.n <= MANY else ()):
        axes.plot(way[:, 0], way[:, 1], color=robot_colour(k), lw=0.8, ls=(0, (1, 2.5)), alpha=0.8, zorder=2)
    for k in range(rules.n):
        colour = robot_colour(k)
        axes.plot(where[:, k, 0], where[:, k, 1], color=colour, lw=thin, solid_joinstyle="round", zorder=3)
        axes.plot(*of.start[b, k], "o", ms=4 if rules.n <= MANY else 2, color=colour, zorder=4)
        axes.plot(*of.goal[b, k], "x", ms=7 if rules.n <= MANY else 3, mew=1.6, color=colour, zorder=5)
        _disc(axes, where[-1, k], rules.r, facecolor=colour, alpha=0.3, edgecolor=colour, lw=1.0, zorder=4)
        if rules.n <= 10:
            x, y = (float(part) * 1.05 for part in of.start[b, k])
            axes.text(x, y, str(k), color=colour, fontsize=10, ha="center", va="center", weight="bold")
    if outcome.status[b] in COLLISIONS:
        x, y = where[-1, outcome.involved[b, 0]]
        axes.plot(x, y, "X", ms=13, color=CRASH, mec="white", mew=1.2, zorder=8)


def clearance_png(of: Problem, b: int, outcome: Outcome, film: Film, label: str) -> bytes:
    """Return the smallest gaps of run b against the step as PNG; arrivals of robots are marked."""
    rules, discs = of.rules, of.maps[of.map_of[b]].obstacles
    where = np.array([picture[b] for picture in film.positions])
    step = np.minimum(np.arange(len(where)) * film.every, outcome.steps[b])
    robots, obstacles = _gaps(where, discs, rules.r)

    def draw(figure: Any) -> None:
        axes = figure.add_axes((0.1, 0.13, 0.87, 0.68))
        axes.set_facecolor(GROUND)
        if rules.n > 1:
            axes.plot(step, robots, color="#0072b2", lw=1.5, label="between robots")
        if len(discs):
            axes.plot(step, obstacles, color="#d55e00", lw=1.5, label="to obstacles")
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter(PLAIN)
        axes.set_xlim(0, max(1, int(step[-1])))
        axes.set_xlabel("step", color=FAINT)
        axes.set_ylabel("smallest gap [radii of the disk]", color=FAINT)
        axes.axhline(rules.r, color=FAINT, lw=0.8, ls=":")
        axes.text(step[-1] * 0.005, rules.r, "a robot's radius", color=FAINT, fontsize=8, ha="left", va="bottom")
        foot = axes.get_xaxis_transform()
        for k in np.flatnonzero(outcome.arrival[b] >= 0) if rules.n <= MANY else ():
            axes.plot(outcome.arrival[b, k], 0.02, "^", color=robot_colour(int(k)), ms=7, transform=foot, clip_on=False)
        if rules.n > 1 or len(discs):
            figure.legend(loc="upper right", bbox_to_anchor=(0.985, 0.97), ncols=2, frameon=False, fontsize=9)
        _plain_axes(axes)
        least = [f"{outcome.robot_gap[b]:.2e} between robots"] if rules.n > 1 else []
        least += [f"{outcome.obstacle_gap[b]:.2e} to obstacles"] if len(discs) else []
        words = f"smallest of all steps: {', '.join(least) or 'nothing to touch'}; triangles: a robot has arrived"
        _title(figure, f"Clearance: {label} on {of.maps[of.map_of[b]].name}", words)

    return _png(draw, (8.6, 4.6))


def field_png(situation: Situation, found: Basins, coarse: float = 1.0) -> bytes:
    """Return the field of one robot's velocities as PNG: where it goes from anywhere, and where it gets stuck.

    Equipotentials are drawn where the controller has a potential. ``coarse`` is as in ``stalls.basins``.
    """
    followed = paths(situation, coarse=coarse)
    potential = potential_on_grid(situation, POTENTIAL_POINTS) if has_potential(situation) else None

    def draw(figure: Any) -> None:
        axes = figure.add_axes((0.02, 0.075, 0.96, 0.815))
        _draw_place(axes, situation.map, situation.rules.r)
        _draw_basins(axes, found)
        if potential is not None:
            _draw_potential(axes, potential)
        _draw_followed(axes, followed)
        for stall in found.stalls:
            axes.plot(stall.x, stall.y, "o", ms=11, mfc="white", mec=STUCK, mew=2.6, zorder=7)
        colour = robot_colour(situation.robot)
        axes.plot(*situation.goal, "X", ms=13, color=colour, mec="white", zorder=8)
        if situation.others is not None:
            for k, place in enumerate(situation.others):
                if k != situation.robot:
                    _disc(axes, place, situation.rules.r, facecolor=robot_colour(k), alpha=0.6, zorder=6)
        _field_legend(axes, found, potential is not None)
        others = "alone" if situation.others is None else "the others stand"
        arrive = found.share(0)
        words = f"robot {situation.robot}, {others}: from {arrive:.1%} of the free points it arrives"
        _title(figure, f"{situation.kind.name} on {situation.map.name}", words)

    return _png(draw, (7.2, 8.1))


def _draw_basins(axes: Axes, found: Basins) -> None:
    from matplotlib.colors import ListedColormap

    kinds = np.full(found.labels.shape, np.nan)
    for value, chosen in enumerate((found.labels > 0, found.labels == CIRCLES, found.labels == TOUCHES)):
        kinds[chosen] = value
    half = 0.5 * (found.grid.x[1] - found.grid.x[0])
    edge = found.grid.x[0] - half, found.grid.x[-1] + half, found.grid.y[0] - half, found.grid.y[-1] + half
    colours = ListedColormap([STUCK, ROUND_AND_ROUND, TOUCHING])
    axes.imshow(kinds, origin="lower", extent=edge, cmap=colours, vmin=0, vmax=2, alpha=0.45, zorder=2)


def _draw_followed(axes: Axes, followed: Sequence[Floats]) -> None:
    """Draw where robots go from the points of a grid, with an arrow at each start."""
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(list(followed), colors="#44515c", linewidths=0.7, alpha=0.75, zorder=3))
    begin = np.array([way[0] for way in followed])
    ahead = np.array([way[min(4, len(way) - 1)] for way in followed]) - begin
    length = np.linalg.norm(ahead, axis=1)
    moves = length > 0.0
    turn = ahead[moves] / length[moves, None]
    axes.quiver(
        *begin[moves].T, *turn.T, color="#2b333b", scale=42, width=0.003, headwidth=4.5, headlength=4.5, zorder=4
    )  # fmt: skip


def _draw_potential(axes: Axes, potential: Floats) -> None:
    side = np.linspace(-1.0, 1.0, len(potential))
    finite = potential[np.isfinite(potential)]
    levels = np.unique(np.quantile(finite, np.linspace(0.01, 0.99, LEVELS)))
    values = np.ma.masked_invalid(potential)
    axes.contour(side, side, values, levels=levels, cmap="viridis", linewidths=0.9, alpha=0.85, zorder=2.5)


def _field_legend(axes: Axes, found: Basins, potential: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [Line2D([], [], color="#44515c", lw=1, label="where it goes")]
    if potential:
        handles.append(Line2D([], [], color="#21918c", lw=1, label="equipotentials"))
    if found.stalls:
        handles.append(Patch(color=STUCK, alpha=0.45, label="gets stuck"))
        handles.append(Line2D([], [], ls="", marker="o", mfc="white", mec=STUCK, mew=2.4, ms=9, label="... here"))
    for label, colour, words in ((CIRCLES, ROUND_AND_ROUND, "circles for ever"), (TOUCHES, TOUCHING, "touches")):
        if (found.labels == label).any():
            handles.append(Patch(color=colour, alpha=0.45, label=words))
    axes.legend(
        handles=handles, loc="upper center", bbox_to_anchor=(0.5, 0.005), ncols=len(handles), frameon=False, fontsize=9
    )


def repulsion_png(params: report.Params) -> bytes:
    """Return Fig. 2 of the report as PNG: how hard a thing pushes against the gap to it, as the controller computes it.

    Left on plain scales, as there; right on logarithmic ones, where the cube is a line and the floor can be seen.
    """

    def draw(figure: Any) -> None:
        near = min(params.obstacle_buffer, params.robot_buffer)
        plain = figure.add_axes((0.09, 0.13, 0.38, 0.68))
        _draw_push(plain, np.linspace(0.1 * near, 1.5 * max(params[:2]), 400), params)
        both = figure.add_axes((0.59, 0.13, 0.38, 0.68))
        both.set_xscale("log")
        both.set_yscale("log")
        _draw_push(both, np.geomspace(*GAPS, 400), params)
        both.axhline(FARTHEST, color=ROBOTS[2], lw=1.2)
        both.text(GAPS[0], FARTHEST * 1.6, "the longest attraction", color=ROBOTS[2], fontsize=8, va="bottom")
        both.set_xlim(*GAPS)
        both.set_ylim(0.5, None)
        words = (
            f"1 / gap^3, from gaps of {report.FLOOR:g} on, added to the way to the goal; dashed: nothing is added there"
        )
        _title(figure, "Repulsion of the report's controller", words)

    return _png(draw, (9.6, 4.4))


def _draw_push(axes: Axes, gaps: Floats, params: report.Params) -> None:
    """Draw the push at some gaps, whole as far as robots repel, with a line at each buffer."""
    push = np.array([report.repulsion(1.0, float(gap)) for gap in gaps])  # the way off the thing, of length 1
    reach = max(params.obstacle_buffer, params.robot_buffer)
    axes.set_facecolor(GROUND)
    axes.plot(gaps[gaps <= reach], push[gaps <= reach], color=INK, lw=1.8)
    axes.plot(gaps[gaps >= reach], push[gaps >= reach], color=INK, lw=1.2, ls=(0, (3, 3)))
    buffers = (
        (params.obstacle_buffer, "obstacles", ROBOTS[1], "right"),
        (params.robot_buffer, "robots", ROBOTS[0], "left"),
    )
    for buffer, what, colour, side in buffers:
        if buffer <= 0.0:
            continue  # no place on a logarithmic axis, and nothing is pushed
        axes.axvline(buffer, color=colour, lw=1.2)
        words, beside = f" {what} push below {buffer:g} ", axes.get_xaxis_transform()
        axes.text(
            buffer,
            0.97,
            words,
            color=colour,
            fontsize=8,
            rotation=90,
            ha=side,
            va="top",
            transform=beside,
            clip_on=True,
        )
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(PLAIN)
    axes.set_xlabel("gap [radii of the disk]", color=FAINT)
    axes.set_ylabel("length of the push", color=FAINT)
    _plain_axes(axes)


def _draw_place(axes: Axes, place: DiskMap, r: float) -> None:
    """Draw the disk, its obstacles, and how near to them a centre may come."""
    from matplotlib.patches import Circle

    axes.set_xlim(-1.1, 1.1)
    axes.set_ylim(-1.1, 1.1)
    axes.set_aspect("equal")
    axes.axis("off")
    axes.add_patch(Circle((0, 0), 1.0, facecolor=GROUND, edgecolor=INK, lw=1.2, zorder=0))
    for x, y, radius in place.obstacles:
        _disc(axes, (x, y), radius + r, facecolor="none", edgecolor=SOLID_EDGE, lw=0.7, ls=(0, (3, 3)), zorder=1)
    for x, y, radius in place.obstacles:
        _disc(axes, (x, y), radius, facecolor=SOLID, edgecolor=SOLID_EDGE, lw=0.8, zorder=1)


def _disc(axes: Axes, centre: Any, radius: float, **style: Any) -> None:
    from matplotlib.patches import Circle

    axes.add_patch(Circle((float(centre[0]), float(centre[1])), radius, **style))


def _shortest_ways(of: Problem, b: int) -> list[Floats]:
    """Return the shortest way of each robot, as points."""
    ways, fields = bounds.ways_of(of.part(slice(b, b + 1)))
    found = []
    for k in range(of.rules.n):
        point, points, out = of.start[b, k].copy(), [of.start[b, k].copy()], np.empty((1, 3))
        for _ in range(int(8.0 / TRACE_STEP)):
            geodesic.look_up_many(ways, fields[0, k : k + 1], point[None], out)
            if not TRACE_STEP < out[0, 0] < np.inf:
                break
            point += TRACE_STEP * out[0, 1:]
            points.append(point.copy())
        found.append(np.array([*points, goals(tuple(of.permutation[b]))[k]]))
    return found


def _gaps(where: Floats, discs: Floats, r: float) -> tuple[Floats, Floats]:
    """Return the smallest gaps at each time, between robots and to obstacles (infinity where there is nothing)."""
    times, n = where.shape[:2]
    robots, obstacles = np.full(times, np.inf), np.full(times, np.inf)
    for k in range(n):
        if k + 1 < n:
            apart = np.linalg.norm(where[:, k + 1 :] - where[:, k : k + 1], axis=2).min(axis=1)
            robots = np.minimum(robots, apart - 2 * r)
        if len(discs):
            apart = np.linalg.norm(where[:, k, None] - discs[None, :, :2], axis=2) - discs[:, 2]
            obstacles = np.minimum(obstacles, apart.min(axis=1) - r)
    return robots, obstacles


def _run_words(of: Problem, b: int, outcome: Outcome, bound: int) -> str:
    ended = STATUS_WORDS[outcome.status[b]]
    ratio = f", {outcome.steps[b] / bound:.3f} of the bound {bound}" if ended == "arrived" else f" (bound {bound})"
    dots = "; dots: shortest ways" if of.rules.n <= MANY else ""
    return f"{_permutation_words(of, b)}: {ended}, {outcome.steps[b]} steps{ratio}{dots}"


def _permutation_words(of: Problem, b: int) -> str:
    if of.rules.n > 10:
        return f"{of.rules.n} robots"
    return f"goals {','.join(str(k) for k in of.permutation[b])}"


def _plain_axes(axes: Axes) -> None:
    axes.tick_params(colors=FAINT, labelsize=8, length=3)
    for spine in axes.spines.values():
        spine.set_color("#d5d8da")


def _title(figure: Any, title: str, words: str) -> None:
    height = figure.get_size_inches()[1]
    figure.text(0.03, 1.0 - 0.36 / height, title, fontsize=13, color=INK, weight="bold")
    figure.text(0.03, 1.0 - 0.62 / height, words, fontsize=9.5, color=FAINT)


def _png(draw: Callable[[Any], None], size: tuple[float, float]) -> bytes:
    """Return what ``draw`` puts on a figure; the same drawing gives the same bytes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with drawing():
        figure = Figure(figsize=size, dpi=130, facecolor="white")
        FigureCanvasAgg(figure)
        draw(figure)
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()

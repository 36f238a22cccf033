"""The picture of a run: the paths over the world, one PNG."""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from swarmscope.lettering import drawing
from swarmscope.sim.world import Circle, Door, Grid, Obstacle, Polygon, Wall
from swarmscope.viewing.colours import (
    CRASH,
    FAINT,
    GROUND,
    INK,
    MOVER,
    PACKET,
    SOLID,
    SOLID_EDGE,
    WALL,
    robot_colours,
)
from swarmscope.viewing.run_data import (
    RunData,
    crash_ticks,
    decision_ticks,
    headline,
    load_run,
    replace_file,
    shown_bounds,
    summary_rows,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LONG_SIDE_IN = 9.0
"""Longer side of the drawn world on paper [inch]."""

CLOSE_RADII = 10.0
"""What is shown round the robots' ways in a picture of only those, radii of a robot."""
SEAM = 0.6
"""Width of the lines round pieces of a map [pt]: thinner ones leave light seams between them."""
PACKET_OPACITY, FEW_PACKETS = 0.55, 150
"""Of the line that stands for a packet; up to so many are drawn alike."""

WAY: dict[str, Any] = {"color": MOVER, "lw": 1.0, "ls": (0, (4, 3)), "zorder": 1}
DOOR: dict[str, Any] = {"lw": 1.6, "ls": (0, (2, 1.5))}
MOST_NUMBERS = 60
"""More robots have no numbers in the picture: one could not read them."""


def write_picture(run_dir: Path, close: bool = False) -> Path:
    """Write ``paths.png`` into the run folder and return its path; the same run gives the same bytes.

    ``close`` shows where the robots have been instead of the whole world.
    """
    run = load_run(run_dir)
    return replace_file(run.folder / "paths.png", _render(run, close))


def _render(run: RunData, close: bool) -> bytes:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with drawing():
        extent = extent_of(run, close)
        width, height = extent[2] - extent[0], extent[3] - extent[1]
        inch = LONG_SIDE_IN / max(width, height)
        size = (max(6.0, width * inch) + 1.0, max(2.5, height * inch) + 1.7)
        figure = Figure(figsize=size, dpi=150, facecolor="white")
        FigureCanvasAgg(figure)
        axes = figure.add_axes((0.7 / size[0], 1.15 / size[1], 1.0 - 1.0 / size[0], 1.0 - 1.7 / size[1]))
        draw_frame(axes, extent)
        draw_obstacles(axes, run.world.obstacles)
        _draw_packets(axes, run)
        _draw_robots(axes, run)
        _draw_words(axes, figure, run)
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def extent_of(run: RunData, close: bool = False) -> tuple[float, float, float, float]:
    """Return x0, y0, x1, y1 [m] around what is worth looking at and everything a robot did, ``close``: only this."""
    margin = (CLOSE_RADII if close else 2.0) * max(robot.radius for robot in run.world.robots)
    xs = np.concatenate([run.trajectory.x_m.ravel(), [robot.goal[0] for robot in run.world.robots]])
    ys = np.concatenate([run.trajectory.y_m.ravel(), [robot.goal[1] for robot in run.world.robots]])
    low, high = (xs.min() - margin, ys.min() - margin), (xs.max() + margin, ys.max() + margin)
    if not close:
        x0, y0, x1, y1 = shown_bounds(run.world)
        low, high = (min(x0, low[0]), min(y0, low[1])), (max(x1, high[0]), max(y1, high[1]))
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def draw_frame(axes: Axes, extent: tuple[float, float, float, float]) -> None:
    """Draw the ground and the scales of ``extent`` x0, y0, x1, y1 [m]."""
    axes.set_xlim(extent[0], extent[2])
    axes.set_ylim(extent[1], extent[3])
    axes.set_aspect("equal")
    axes.set_facecolor(GROUND)
    axes.tick_params(colors=FAINT, labelsize=8, length=3)
    axes.set_xlabel("x [m]", color=FAINT, fontsize=8, labelpad=2)
    axes.set_ylabel("y [m]", color=FAINT, fontsize=8, labelpad=4)
    for spine in axes.spines.values():
        spine.set_color("#d5d8da")


def draw_obstacles(axes: Axes, obstacles: list[Obstacle]) -> None:
    """Draw what stands in the world."""
    from matplotlib import patches
    from matplotlib.collections import LineCollection, PatchCollection

    solids: list[patches.Patch] = []
    for obstacle in obstacles:
        if isinstance(obstacle, Circle) and obstacle.moves:
            _draw_way(axes, obstacle)
        elif isinstance(obstacle, Circle):
            solids.append(patches.Circle(obstacle.center, obstacle.radius))
        elif isinstance(obstacle, Polygon):
            solids.append(patches.Polygon(obstacle.points))
        elif isinstance(obstacle, Grid):
            _draw_grid(axes, obstacle)
    axes.add_collection(PatchCollection(solids, facecolor=SOLID, edgecolor=SOLID_EDGE, linewidth=0.8))
    walls = [obstacle.points for obstacle in obstacles if isinstance(obstacle, Wall)]
    axes.add_collection(LineCollection(walls, colors=WALL, linewidths=2.2, capstyle="round"))
    doors = [obstacle.points for obstacle in obstacles if isinstance(obstacle, Door)]
    axes.add_collection(LineCollection(doors, colors=WALL, **DOOR))


def _draw_way(axes: Axes, disc: Circle) -> None:
    """Draw a disc that moves where it begins, and its way."""
    from matplotlib import patches

    limits = axes.get_xlim(), axes.get_ylim()
    if disc.velocity is not None:
        far = math.dist(*np.transpose(limits)) / max(math.hypot(*disc.velocity), 1e-9)
        axes.plot(*np.transpose([disc.center, np.add(disc.center, np.multiply(far, disc.velocity))]), **WAY)
    else:
        points = [disc.center, *(disc.way or []), *([disc.center] if disc.repeat == "loop" else [])]
        axes.plot(*np.transpose(points), **WAY)
    axes.add_patch(patches.Circle(disc.center, disc.radius, fc=MOVER, ec=SOLID_EDGE, lw=0.8, alpha=0.55))
    axes.set_xlim(*limits[0])
    axes.set_ylim(*limits[1])


def _draw_grid(axes: Axes, grid: Grid) -> None:
    from matplotlib.collections import PolyCollection

    side, c, s = grid.resolution, math.cos(grid.yaw), math.sin(grid.yaw)
    runs = np.asarray(grid.rows, dtype=np.float64).reshape(-1, 3)
    low, left, right = side * runs[:, 0], side * runs[:, 1], side * (runs[:, 2] + 1.0)
    corners = np.array([[left, low], [right, low], [right, low + side], [left, low + side]])
    turned = np.array(grid.origin) + corners.transpose(2, 0, 1) @ np.array([[c, s], [-s, c]])
    axes.add_collection(PolyCollection(list(turned), color=SOLID, lw=SEAM))


def _draw_packets(axes: Axes, run: RunData) -> None:
    """Draw a line from sender to receiver of each packet of features, fainter where there are many."""
    from matplotlib.collections import LineCollection

    trajectory, links = run.trajectory, run.trajectory.links
    places = np.stack([trajectory.x_m, trajectory.y_m], axis=2)
    lines = places[links[:, :1], links[:, 1:3]]
    opacity = PACKET_OPACITY * min(1.0, math.sqrt(FEW_PACKETS / max(1, len(links))))
    axes.add_collection(LineCollection(list(lines), colors=PACKET, linewidths=0.8, alpha=opacity))


def _draw_robots(axes: Axes, run: RunData) -> None:
    trajectory, robots = run.trajectory, run.world.robots
    colours = robot_colours(len(robots))
    ends = np.minimum(crash_ticks(trajectory), trajectory.t_s.size - 1)
    goals = np.array([robot.goal for robot in robots])
    axes.scatter(goals[:, 0], goals[:, 1], s=70, facecolor="none", edgecolor=colours, lw=1.4)
    for i, colour in enumerate(colours):
        x, y = trajectory.x_m[:, i], trajectory.y_m[:, i]
        axes.plot(x, y, color=colour, lw=1.5, alpha=0.9, solid_joinstyle="round", solid_capstyle="round")
        axes.scatter(robots[i].start[0], robots[i].start[1], s=22, color=[colour], lw=0, zorder=3)
        if len(robots) <= MOST_NUMBERS:
            _draw_number(axes, i, robots[i].start[:2], colour)
        chosen = decision_ticks(trajectory, i)
        axes.scatter(
            x[chosen], y[chosen], s=26, marker="D", facecolor="white", edgecolor=[colour], lw=1.1, zorder=4
        )
        if trajectory.collided[i]:
            end = x[ends[i]], y[ends[i]]
            axes.scatter(*end, marker="X", s=95, facecolor=CRASH, edgecolor="white", lw=1.0, zorder=5)


def _draw_number(axes: Axes, robot: int, place: tuple[float, float], colour: Any) -> None:
    """Write a robot's number beside its start."""
    from matplotlib.patheffects import withStroke

    words = {"fontsize": 7, "color": colour, "path_effects": [withStroke(linewidth=2.0, foreground=GROUND)]}
    axes.annotate(str(robot), place, xytext=(4, 4), textcoords="offset points", zorder=6, **words)


def _draw_words(axes: Axes, figure: Any, run: RunData) -> None:
    from matplotlib.lines import Line2D

    axes.set_title(headline(run), loc="left", fontsize=12, color=INK, pad=10, fontweight="bold")
    entries = [("start", "o", 5, FAINT, FAINT), ("goal", "o", 8, "none", FAINT)]
    entries.append(("side chosen", "D", 5, "white", FAINT))
    if len(run.trajectory.links):
        entries.append(("features sent", "_", 9, PACKET, PACKET))
    if np.any(run.trajectory.collided):
        entries.append(("collision", "X", 8, CRASH, "white"))
    if any(isinstance(obstacle, Circle) and obstacle.moves for obstacle in run.world.obstacles):
        entries.append(("moves by itself", "o", 8, MOVER, SOLID_EDGE))
    handles = [
        Line2D([], [], ls="none", label=label, marker=marker, ms=size, mfc=face, mec=edge)
        for label, marker, size, face, edge in entries
    ]
    if any(isinstance(obstacle, Door) for obstacle in run.world.obstacles):
        handles.append(Line2D([], [], label="door", color=WALL, **DOOR))
    figure.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=(0.6 / figure.get_figwidth(), 0.36 / figure.get_figheight()),
        ncols=len(handles),
        frameon=False,
        fontsize=8.5,
        labelcolor=INK,
        handletextpad=0.2,
        columnspacing=1.4,
        borderpad=0.0,
    )
    caption = "     ".join(f"{words}  {value}" for words, value in summary_rows(run)[:4])
    figure.text(0.7 / figure.get_figwidth(), 0.16 / figure.get_figheight(), caption, fontsize=9, color=INK)

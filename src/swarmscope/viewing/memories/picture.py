"""What a robot knew before and after a search, as a picture: its own map, the way that it meant to go, the new one."""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.lettering import drawing
from swarmscope.viewing.colours import FAINT, INK
from swarmscope.viewing.memories.again import SIDES, Memories, Moment
from swarmscope.viewing.pictures import draw_frame, draw_obstacles, extent_of
from swarmscope.viewing.run_data import RunData

if TYPE_CHECKING:
    from matplotlib.axes import Axes

KNOWN, WAY, GONE = "#0072b2", "#c23b22", "#2b333b"
SAMPLES = 16
"""Places along two ways at which they are compared."""
WIDTH_IN, DPI = 11.0, 110

Floats = NDArray[np.float64]


class Turn(NamedTuple):
    """A search that led somewhere else."""

    before: Moment
    after: Moment
    apart_m: float
    """How far the two ways are apart, mean over both."""


def turns_of(memories: Memories, robot: int | None = None) -> list[Turn]:
    """Return the searches (of one robot) that led somewhere else, those that changed most first."""
    last: dict[int, Moment] = {}
    found = []
    for moment in memories.moments:
        before = last.get(moment.robot)
        if moment.searched and before is not None and (robot is None or moment.robot == robot):
            found.append(Turn(before, moment, _apart(before, moment, memories.cell_m)))
        last[moment.robot] = moment
    return sorted(found, key=lambda turn: -turn.apart_m)


def known_at(memories: Memories, moment: Moment) -> NDArray[np.int64]:
    """Return what was in a robot's map at a moment (n, 3): kind, x, y of each cell or node."""
    known: set[tuple[int, int, int]] = set()
    for one in memories.moments:
        if one.robot == moment.robot:
            known ^= {(int(kind), int(x), int(y)) for kind, x, y in one.toggled}
        if one is moment:
            break
    return np.array(sorted(known), np.int64).reshape(-1, 3)


def turn_png(run: RunData, memories: Memories, turn: Turn) -> bytes:
    """Return a search as PNG: what the robot knew and meant to do before it, and after it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    extent = extent_of(run)
    tall = (extent[3] - extent[1]) / (extent[2] - extent[0])
    with drawing():
        size = (WIDTH_IN, 0.5 * WIDTH_IN * min(1.6, tall) + 0.6)
        figure = Figure(figsize=size, dpi=DPI, facecolor="white", layout="constrained")
        FigureCanvasAgg(figure)
        panels: Any = figure.subplots(1, 2)
        for axes, moment, words in zip(panels, turn[:2], ("before its search", "after it"), strict=True):
            draw_frame(axes, extent)
            draw_obstacles(axes, run.world.obstacles)
            _draw_moment(axes, run, memories, moment)
            t_s = run.trajectory.t_s[moment.tick]
            title = f"robot {run.world.robots[moment.robot].id} at {t_s:.1f} s, {words}"
            axes.set_title(title, loc="left", fontsize=10, color=INK)
        out = io.BytesIO()
        figure.savefig(out, format="png", metadata={"Software": None})
    return out.getvalue()


def in_world(moment: Moment, cell_m: float, places: Floats) -> Floats:
    """Return places (n, 2) of a robot's map [cells] in the world [m]."""
    x, y, turn = moment.frame
    c, s = math.cos(turn), math.sin(turn)
    turned: Floats = np.array([x, y]) + cell_m * places @ np.array([[c, s], [-s, c]])
    return turned


def _apart(before: Moment, after: Moment, cell_m: float) -> float:
    """Return how far two ways are apart [m]: mean over the places on both of the distance to the other."""
    if not len(before.way) or not len(after.way):
        return 0.0
    first, second = (_sampled(np.vstack([after.place, one.way])) for one in (before, after))
    gaps = np.hypot(*np.moveaxis(first[:, None] - second[None], 2, 0))
    return float(cell_m * 0.5 * (gaps.min(axis=0).mean() + gaps.min(axis=1).mean()))


def _sampled(way: Floats) -> Floats:
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))])
    at = np.linspace(0.0, along[-1], SAMPLES)
    return np.column_stack([np.interp(at, along, way[:, k]) for k in range(2)])


def _draw_moment(axes: Axes, run: RunData, memories: Memories, moment: Moment) -> None:
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Circle

    known = known_at(memories, moment)
    side = np.array(SIDES)[known[:, 0]][:, None, None]
    corners = side * (known[:, None, 1:] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]]))
    squares = in_world(moment, memories.cell_m, corners.reshape(-1, 2).astype(float)).reshape(-1, 4, 2)
    axes.add_collection(PolyCollection(list(squares), color=KNOWN, lw=0.3, zorder=3))
    x, y = run.trajectory.x_m[:, moment.robot], run.trajectory.y_m[:, moment.robot]
    axes.plot(x[: moment.tick + 1], y[: moment.tick + 1], color=GONE, lw=1.1, alpha=0.8, zorder=4)
    here = float(x[moment.tick]), float(y[moment.tick])
    way = np.vstack([here, in_world(moment, memories.cell_m, moment.way)])
    axes.plot(*way.T, color=WAY, lw=1.8, ls=(0, (4, 2)), zorder=5)
    robot = run.world.robots[moment.robot]
    axes.add_patch(Circle(here, robot.radius, fc=GONE, ec="white", lw=0.8, zorder=6))
    axes.scatter(*robot.goal, s=80, facecolor="none", edgecolor=WAY, lw=1.6, zorder=6)
    others = [i for i in range(len(run.world.robots)) if i != moment.robot]
    places = run.trajectory.x_m[moment.tick, others], run.trajectory.y_m[moment.tick, others]
    axes.scatter(*places, s=10, color=FAINT, lw=0, zorder=4)

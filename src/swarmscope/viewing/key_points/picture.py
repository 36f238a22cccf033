"""Key points as pictures: what stands there, who was heard, how much each weighed, and what came of it."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from swarmscope.lettering import drawing
from swarmscope.viewing.colours import FAINT, GROUND, INK
from swarmscope.viewing.key_points.again import KeyPoint
from swarmscope.viewing.pictures import draw_obstacles
from swarmscope.viewing.run_data import RunData

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CHOOSER, NEIGHBOUR, TRUTH = "#0072b2", "#009e73", "#d55e00"
AROUND_M = 1.0
"""Shown beyond the farthest who was heard [m]."""
LEAST_M = 2.5
"""Shown round the robot at least [m]."""
THICK = 14.0
"""Width of the line of a weight of 1 [pt]."""
TAKEN_TURN, TRUE_TURN = 0.9, 0.6
"""Arrows of sides stand so far off the goal's direction [rad]."""
ACROSS, PANEL_IN = 2, 4.6
DPI = 100


def most_moved(points: Sequence[KeyPoint], count: int) -> list[KeyPoint]:
    """Return the choices that neighbours moved most, at most ``count``, one of each robot, in their order.

    Those for which the true map has no side are left out.
    """
    moved: dict[int, KeyPoint] = {}
    told = [one for one in points if one.heard and one.true_side]
    for one in sorted(told, key=lambda one: -abs(one.p_left - one.p_self)):
        moved.setdefault(one.robot, one)
    return sorted(list(moved.values())[:count])


def side_words(side: int) -> str:
    """Return the name of a side."""
    return {1: "left", -1: "right"}.get(side, "neither")


def key_points_png(run: RunData, points: Sequence[KeyPoint]) -> bytes:
    """Return the key points of a run as PNG, a panel each."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    down = math.ceil(len(points) / ACROSS)
    with drawing():
        size = (ACROSS * PANEL_IN, down * (PANEL_IN + 0.9))
        figure = Figure(figsize=size, dpi=DPI, facecolor="white", layout="constrained")
        FigureCanvasAgg(figure)
        panels: list[Any] = figure.subplots(down, ACROSS, squeeze=False).ravel().tolist()
        for k, axes in enumerate(panels):
            if k < len(points):
                _draw(axes, run, points[k])
            else:
                axes.axis("off")
        out = io.BytesIO()
        figure.savefig(out, format="png", metadata={"Software": None})
    return out.getvalue()


def _draw(axes: Axes, run: RunData, point: KeyPoint) -> None:
    x, y = run.trajectory.x_m[point.tick], run.trajectory.y_m[point.tick]
    away = [math.hypot(x[i] - point.x, y[i] - point.y) for i in point.heard]
    reach = max(LEAST_M, max(away, default=0.0) + AROUND_M)
    weights = dict(zip((point.robot, *point.heard), point.weight.tolist(), strict=True))
    _frame(axes, point, reach)
    draw_obstacles(axes, run.world.obstacles)
    for i, robot in enumerate(run.world.robots):
        colour = CHOOSER if i == point.robot else NEIGHBOUR if i in point.heard else FAINT
        words = f"{i}: {weights[i]:.2f}" if i in weights else str(i)
        beside = -1 if x[i] < point.x else 1  # words stand on the side where no line goes
        _robot(axes, words, float(x[i]), float(y[i]), robot.radius, colour, beside)
    for i in point.heard:
        ends = [x[i], point.x], [y[i], point.y]
        axes.plot(*ends, color=NEIGHBOUR, lw=THICK * weights[i], alpha=0.5, solid_capstyle="butt", zorder=3)
    _arrow(axes, point, 0.0, 0.5 * reach, FAINT, "goal")
    _arrow(axes, point, TAKEN_TURN * point.side, 0.38 * reach, CHOOSER, "taken")
    if point.true_side:
        _arrow(axes, point, TRUE_TURN * point.true_side, 0.38 * reach, TRUTH, "true")


def _frame(axes: Axes, point: KeyPoint, reach: float) -> None:
    """Set up a panel of ``reach`` [m] round the robot, with what the network said above it."""
    axes.set_xlim(point.x - reach, point.x + reach)
    axes.set_ylim(point.y - reach, point.y + reach)
    axes.set_aspect("equal")
    axes.set_facecolor(GROUND)
    axes.set_xticks([])
    axes.set_yticks([])
    left, right = point.outputs
    taken, true = side_words(point.side), side_words(point.true_side)
    lines = (
        f"choice {point.number}: robot {point.robot} at {point.t_s:.1f} s",
        f"outputs {point.logits[0]:.2f}, {point.logits[1]:.2f}: left {left:.3f}, right {right:.3f}",
        f"alone: left {point.p_self:.3f}, right {1.0 - point.p_self:.3f}",
        f"taken: {taken}; shortest way: {true}",
    )
    axes.set_title("\n".join(lines), fontsize=9, color=INK, loc="left")
    corner = point.x - 0.94 * reach, point.y - 0.92 * reach
    axes.plot([corner[0], corner[0] + 1.0], [corner[1]] * 2, color=INK, lw=2.2, zorder=8, solid_capstyle="butt")
    _text(axes, corner[0] + 0.5, corner[1] + 0.03 * reach, "1 m", INK, ha="center", va="bottom")


def _robot(axes: Axes, words: str, x: float, y: float, radius: float, colour: str, beside: int) -> None:
    """Draw a robot with its words to the right (``beside`` 1) or to the left of it (-1)."""
    from matplotlib.patches import Circle

    axes.add_patch(Circle((x, y), radius, fc=colour, ec="white", lw=0.8, zorder=6))
    _text(axes, x + beside * radius, y + radius, words, colour, ha="left" if beside > 0 else "right", va="bottom")


def _arrow(axes: Axes, point: KeyPoint, turn: float, length: float, colour: str, name: str) -> None:
    """Draw an arrow of ``length`` [m] from the robot, turned by ``turn`` [rad] from its goal's direction."""
    c, s = math.cos(point.target + turn), math.sin(point.target + turn)
    tip = point.x + length * c, point.y + length * s
    style: Any = {"arrowstyle": "-|>", "color": colour, "lw": 1.6, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", tip, (point.x, point.y), arrowprops=style, zorder=7)
    _text(axes, tip[0] + 0.12 * length * c, tip[1] + 0.12 * length * s, name, colour, ha="center", va="center")


def _text(axes: Axes, x: float, y: float, words: str, colour: str, **where: Any) -> None:
    from matplotlib.patheffects import withStroke

    text = axes.text(x, y, words, color=colour, fontsize=8, zorder=9, clip_on=True, **where)
    text.set_path_effects([withStroke(linewidth=2.2, foreground="white")])

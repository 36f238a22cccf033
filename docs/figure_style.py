"""How the pictures of docs/theory.md look: colours, type, and what polar panels have in common."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np

mpl.use("Agg")

BLUE, ORANGE, GREEN, RED, GREY = "#0072b2", "#d55e00", "#009e73", "#cc3311", "#666666"
INK = "#222222"
STYLE = {
    "figure.dpi": 110,
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "axes.axisbelow": True,
    "svg.hashsalt": "swarmscope",
}


def round_the_robot(ax: mpl.axes.Axes, limit: float, ticks: list[float]) -> None:
    """Lay out a polar panel round a robot: its target above, left on the left, out to ``limit`` [m]."""
    ax.set_theta_zero_location("N")
    ax.set_rlim(0, limit)
    ax.set_rticks(ticks)
    ax.set_rlabel_position(195)
    ax.set_xticks(np.radians([0, 45, 90, 135, 180, 225, 270, 315]))
    ax.set_xticklabels(["target", "45", "90", "135", "180", "-135", "-90", "-45"])
    ax.tick_params(labelsize=8.5)


def closed(angles: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return angles [rad] and values once round the circle, the first again at the end."""
    return np.append(angles, angles[0] + 2 * np.pi), np.append(values, values[0])

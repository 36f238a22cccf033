"""A picture of recorded scans with the safe directions and features that a robot finds in them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from swarmscope.errors import InputFileError
from swarmscope.lettering import drawing
from swarmscope.viewing.colours import FAINT, GROUND, INK

if TYPE_CHECKING:
    from swarmscope.experiments.perceive import Perception

Extent = tuple[float, float, float, float]

PANELS = 6
SHAPES = {1: (1, 1), 2: (1, 2), 3: (1, 3), 4: (2, 2), 5: (2, 3), 6: (2, 3)}
SAFE, FILTERED, FEATURE = "#2a9d57", "#3a6ea5", "#d1495b"
PANEL_IN = 3.2
BESIDE = 0.97
"""The fan of safe directions ends at this share of the way to a return: nothing is drawn over one."""
BARS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0)
"""Lengths of the scale [m]; the largest below a third of the range is taken."""


def write_perceive_picture(path: Path, seen: Perception, title: str) -> Path:
    """Draw ``PANELS`` scans, the richest of each part of the log; return the picture's path."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with drawing():
        chosen = _choose(seen)
        rows, columns = SHAPES[len(chosen)]
        left, right, bottom, top = extent = _extent(seen, chosen)
        wide = PANEL_IN * (right - left) / (top - bottom) if right - left < top - bottom else PANEL_IN
        size = (max(6.2, columns * (wide + 0.25)), rows * (PANEL_IN + 0.35) + 1.15)
        figure = Figure(figsize=size, dpi=130, facecolor="white", layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(rows, columns, squeeze=False)
        for panel in axes.ravel()[len(chosen) :]:
            panel.set_axis_off()
        for panel, k in zip(axes.ravel(), chosen, strict=False):
            _draw_frame(panel, seen, extent)
            _draw_scan(panel, seen, k)
        handles, labels = axes.ravel()[0].get_legend_handles_labels()
        figure.legend(
            handles,
            labels,
            loc="outside lower left",
            ncols=4,
            frameon=False,
            fontsize=8.5,
            labelcolor=INK,
            handlelength=1.6,
        )
        figure.suptitle(title, x=0.012, ha="left", fontsize=12, color=INK, fontweight="bold")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            figure.savefig(path, metadata={"Software": None})
        except OSError as error:
            raise InputFileError(path, f"cannot be written ({error.strerror})") from None
    return path


def _choose(seen: Perception) -> list[int]:
    """Return the scan with most features of each part of the log; among equals the least free."""
    worth = np.array([len(pairs) for pairs in seen.features]) - seen.safe.mean(axis=1)
    parts = np.array_split(np.arange(len(worth)), min(PANELS, len(worth)))
    return [int(part[np.argmax(worth[part])]) for part in parts]


def _extent(seen: Perception, chosen: list[int]) -> Extent:
    """Return left, right, bottom, top [m] round what these scans show, at most the LiDAR's range."""
    ranges = seen.ranges_m[chosen]
    shown = (_ahead(seen), float(seen.filtered_m[chosen].max()), float(ranges[np.isfinite(ranges)].max(initial=0.0)))
    limit = 1.06 * min(max(shown), seen.rig.sensor.range_max)
    return limit * min(-0.1, float(np.cos(seen.angles).min())), limit, -limit, limit


def _draw_frame(panel: Any, seen: Perception, extent: Extent) -> None:
    """Draw how far the LiDAR sees, the robot, and a scale."""
    from matplotlib.patches import Circle

    left, right, bottom, top = extent
    panel.set_xlim(left, right)
    panel.set_ylim(bottom, top)
    panel.set_aspect("equal")
    panel.set_facecolor(GROUND)
    panel.tick_params(bottom=False, left=False, labelbottom=False, labelleft=False)
    for spine in panel.spines.values():
        spine.set_color("#d5d8da")
    sensor, radius = seen.rig.sensor, seen.rig.body.radius_m
    x, y = sensor.range_max * np.cos(seen.angles), sensor.range_max * np.sin(seen.angles)
    if not sensor.wraps:
        x, y = np.concatenate([[0.0], x, [0.0]]), np.concatenate([[0.0], y, [0.0]])
    panel.fill(x, y, facecolor="white", edgecolor="#d5d8da", lw=0.8, zorder=0)
    panel.add_patch(Circle((0.0, 0.0), radius, facecolor=INK, lw=0.0, zorder=5))
    panel.plot([0.0, 1.8 * radius], [0.0, 0.0], color=INK, lw=1.4, zorder=5, solid_capstyle="round")
    _draw_scale(panel, right, bottom, top)


def _draw_scale(panel: Any, right: float, bottom: float, limit: float) -> None:
    """Draw a line of a round length in the corner, where no scan reaches."""
    bar = max((length for length in BARS if length <= limit / 3.0), default=limit / 3.0)
    end, y = right - 0.05 * limit, bottom + 0.06 * limit
    panel.plot([end - bar, end], [y, y], color=INK, lw=1.6, solid_capstyle="butt")
    panel.text(end - 0.5 * bar, y + 0.03 * limit, f"{bar:g} m", ha="center", va="bottom", fontsize=7.5, color=INK)


def _draw_scan(panel: Any, seen: Perception, k: int) -> None:
    """Draw scan ``k`` seen from above."""
    cos, sin = np.cos(seen.angles), np.sin(seen.angles)
    _draw_fan(panel, seen, k)
    panel.plot(
        *_closed(seen, seen.filtered_m[k] * cos, seen.filtered_m[k] * sin),
        color=FILTERED,
        lw=1.1,
        label="filtered scan",
    )
    hit = np.isfinite(seen.ranges_m[k])
    r = seen.ranges_m[k][hit]
    panel.plot(r * cos[hit], r * sin[hit], ".", color=INK, ms=2.6, label="returns", zorder=3)
    pairs = seen.features[k]
    x, y = pairs[:, 1] * np.cos(pairs[:, 0]), pairs[:, 1] * np.sin(pairs[:, 0])
    panel.plot(x, y, "o", color=FEATURE, ms=5, mec="white", mew=0.8, label="features sent", zorder=4)
    words = "feature" if len(pairs) == 1 else "features"
    caption = f"scan {k}: {len(pairs)} {words}, {seen.packet_bytes[k]} bytes"
    panel.set_title(caption, loc="left", fontsize=8.5, color=FAINT, pad=4)


def _draw_fan(panel: Any, seen: Perception, k: int) -> None:
    """Fill the safe directions as far as they are kept free, and never as far as a return."""
    reach = fan_reach(seen, k)
    cos, sin = np.cos(seen.angles), np.sin(seen.angles)
    free = f"safe directions, up to {_ahead(seen):.2g} m"
    edges = np.flatnonzero(np.diff(np.concatenate([[0], seen.safe[k].astype(int), [0]])))
    for first, last in edges.reshape(-1, 2):
        arc = np.arange(first, last)
        if seen.rig.sensor.wraps and last == len(cos) and seen.safe[k, 0]:
            arc = np.append(arc, 0)
        x = np.concatenate([[0.0], reach[arc] * cos[arc], [0.0]])
        y = np.concatenate([[0.0], reach[arc] * sin[arc], [0.0]])
        panel.fill(x, y, facecolor=SAFE, alpha=0.25, lw=0, label=free)
        free = "_nolegend_"
    if free != "_nolegend_":
        panel.fill([], [], facecolor=SAFE, alpha=0.25, lw=0, label=free)


def _ahead(seen: Perception) -> float:
    """Return how far safe directions are free [m]."""
    return min(max(seen.rig.look_ahead, seen.rig.protection.l_th), seen.rig.sensor.range_max)


def fan_reach(seen: Perception, k: int) -> np.ndarray:
    """Return how far the fan of scan ``k`` is drawn in each direction (M,) [m].

    It ends before the nearest return of its own beam and the two beside it: between them lines are straight.
    """
    ranges = np.where(np.isfinite(seen.ranges_m[k]), seen.ranges_m[k], np.inf)
    pad = "wrap" if seen.rig.sensor.wraps else "edge"
    wide = np.pad(ranges, 1, mode=pad)  # type: ignore[call-overload]
    nearest = np.minimum(np.minimum(wide[:-2], wide[2:]), ranges)
    return np.asarray(np.minimum(BESIDE * nearest, _ahead(seen)))


def _closed(seen: Perception, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a line round the robot, closed where the scan is."""
    return (np.append(x, x[0]), np.append(y, y[0])) if seen.rig.sensor.wraps else (x, y)

"""A picture of recorded scans with the safe directions and features that a robot finds in them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from swarmscope.errors import InputFileError

if TYPE_CHECKING:
    from swarmscope.experiments.perceive import Perception

PANELS = 6
SCAN, SAFE, FILTERED, FEATURE = "#444444", "#2a9d57", "#3a6ea5", "#d1495b"


def write_perceive_picture(path: Path, seen: Perception, title: str) -> Path:
    """Draw ``PANELS`` scans, the richest of each part of the log; return the picture's path."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 9.5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 3)
    for panel in axes.ravel():
        panel.set_axis_off()
    for panel, k in zip(axes.ravel(), _choose(seen), strict=False):
        _draw_scan(panel, seen, k)
    handles, labels = axes.ravel()[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle(f"{title}: what a robot makes of a scan (sensor at the centre, looking right)")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=110, metadata={"Software": None})
    except OSError as error:
        raise InputFileError(path, f"cannot be written ({error.strerror})") from None
    return path


def _choose(seen: Perception) -> list[int]:
    """Return the scan with most features of each part of the log; among equals the least free."""
    worth = np.array([len(pairs) for pairs in seen.features]) - seen.safe.mean(axis=1)
    parts = np.array_split(np.arange(len(worth)), min(PANELS, len(worth)))
    return [int(part[np.argmax(worth[part])]) for part in parts]


def _draw_scan(panel: Any, seen: Perception, k: int) -> None:
    """Draw scan ``k`` seen from above."""
    cos, sin = np.cos(seen.angles), np.sin(seen.angles)
    limit = seen.rig.sensor.range_max
    edges = np.flatnonzero(np.diff(np.concatenate([[0], seen.safe[k].astype(int), [0]])))
    label = "safe directions"
    for first, last in edges.reshape(-1, 2):
        arc = np.arange(first, last)
        x = np.concatenate([[0.0], 0.5 * limit * cos[arc], [0.0]])
        y = np.concatenate([[0.0], 0.5 * limit * sin[arc], [0.0]])
        panel.fill(x, y, color=SAFE, alpha=0.25, lw=0, label=label)
        label = "_nolegend_"
    hit = np.isfinite(seen.ranges_m[k])
    panel.plot(
        seen.filtered_m[k] * cos, seen.filtered_m[k] * sin, color=FILTERED, lw=1.2, label="filtered scan"
    )
    r = seen.ranges_m[k][hit]
    panel.plot(r * cos[hit], r * sin[hit], ".", color=SCAN, ms=2.5, label="returns")
    pairs = seen.features[k]
    x, y = pairs[:, 1] * np.cos(pairs[:, 0]), pairs[:, 1] * np.sin(pairs[:, 0])
    panel.plot(x, y, "o", color=FEATURE, ms=6, label="features sent")
    panel.plot(0.0, 0.0, ">", color="black", ms=7)
    words = "feature" if len(pairs) == 1 else "features"
    panel.set_title(f"scan {k}: {len(pairs)} {words}, {seen.packet_bytes[k]} bytes", fontsize=10)
    panel.set_aspect("equal")
    panel.set_xlim(1.05 * limit * min(-0.1, float(cos.min())), 1.05 * limit)
    panel.set_ylim(-1.05 * limit, 1.05 * limit)

"""Makes every figure of docs/theory.md from the project's own code: ``python docs/figures.py [FOLDER [NAME ...]]``."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.patches import Circle, Wedge

from swarmscope.onboard.body import Body, protection_model
from swarmscope.onboard.deciding.fields import interaction_force
from swarmscope.onboard.perception.areas import passable_distance
from swarmscope.onboard.perception.features import MASK_MAXIMA, reconstruct
from swarmscope.onboard.perception.filters import KAISER_BETA, feature_filter, scope_filter
from swarmscope.onboard.rig import PRINTED

sys.path.insert(0, str(Path(__file__).parent))
import matplotlib.pyplot as plt
from figure_cases import convergence, divergence
from figure_chain import chain, features_of, filtered_by, forest_scan, safe_of
from figure_style import BLUE, GREEN, GREY, INK, ORANGE, RED, STYLE, closed, round_the_robot
from figure_worlds import paths, playground

HALF = 30
"""Half the window of 360 beams at alpha = 60 degrees."""
BETAS = (0.0, 1.0, 2.5, 5.0, 8.0)
TABLE_II = {
    "R3": [
        (54, 1.62),
        (83, 1.53),
        (128, 1.78),
        (177, 1.55),
        (231, 1.89),
        (282, 1.55),
        (302, 1.58),
        (359, 1.18),
    ],
    "R2": [(15, 1.60), (43, 1.67), (117, 1.24), (179, 1.83), (285, 1.03), (341, 1.77)],
    "R4": [(8, 1.78), (109, 1.17), (176, 1.85), (237, 1.27), (300, 1.69), (329, 1.62)],
}
"""SFM-MAS Table II: features in R3's frame, angles [deg] and normalised distances."""
QUADRANTS = ((0, 36, BLUE), (-36, 0, ORANGE), (36, 90, BLUE), (-90, -36, ORANGE))
"""Quadrants I to IV of the table's robots [deg], with their colours."""
TABLE_HALF = math.radians(36.0)


def table_features(name: str) -> tuple[np.ndarray, np.ndarray, int]:
    """Return one robot's features of SFM-MAS Table II as the kernels take them."""
    rows = np.array(TABLE_II[name])
    return np.radians(rows[:, 0]), rows[:, 1].copy(), len(rows)


def filter_figures(beta: float, half: int = HALF) -> dict[str, float]:
    """Return what a Kaiser parameter does to the feature filter of ``2 half + 1`` taps."""
    taps = feature_filter(half, beta).astype(float)
    step = np.cumsum(taps)
    index = np.arange(taps.size)
    db, frequency = response_db(taps)
    null = 1 + int(np.argmax(np.diff(db[1:]) > 0.0))
    return {
        "smallest_tap": float(taps[1:-1].min()),
        "overshoot": float(max(0.0, step.max() - 1.0)),
        "rise": float(np.interp(0.9, step, index) - np.interp(0.1, step, index)),
        "at_edge_db": float(np.interp(1.0 / (2 * half), frequency, db)),
        "side_lobe_db": float(db[null:].max()),
    }


def response_db(taps: np.ndarray, points: int = 1 << 15) -> tuple[np.ndarray, np.ndarray]:
    """Return the response [dB] of ``taps`` and its frequencies [cycles per beam]."""
    amplitude = np.abs(np.fft.rfft(taps, points))
    return 20.0 * np.log10(amplitude / amplitude[0] + 1e-12), np.fft.rfftfreq(points)


def protection() -> plt.Figure:
    """Draw the protection model of the 0.15 m robot to scale."""
    body = Body()
    p = protection_model(body)
    half = math.degrees(0.5 * p.alpha)
    figure, axes = plt.subplots(figsize=(8.2, 5.2))
    axes.add_patch(Circle((0, 0), p.sigma_a, fill=False, ls="--", color=GREY))
    axes.add_patch(Wedge((0, 0), p.l_th, 0, half, color=BLUE, alpha=0.22, lw=0))
    axes.add_patch(Wedge((0, 0), p.l_th, -half, 0, color=ORANGE, alpha=0.22, lw=0))
    axes.add_patch(Wedge((0, 0), p.l_th, half, 90, color=BLUE, alpha=0.08, lw=0))
    axes.add_patch(Wedge((0, 0), p.l_th, -90, -half, color=ORANGE, alpha=0.08, lw=0))
    axes.add_patch(Circle((0, 0), p.r, fill=False, color=GREEN, lw=1.8))
    axes.add_patch(Circle((0, 0), body.radius_m, color="#333333"))
    for y in (-body.half_width_m, body.half_width_m):
        axes.plot([0, p.l_th * math.cos(0.5 * p.alpha)], [y, y], color="#333333", lw=0.8, ls=":")
    axes.annotate("", (1.02, 0), (0, 0), arrowprops={"arrowstyle": "->", "color": "#333333"})
    axes.text(1.04, 0, "target", va="center")
    box = {"boxstyle": "square,pad=0.15", "fc": "white", "ec": "none"}
    for text, where, point in (
        (f"body, radius {body.radius_m:.2f} m", (-1.35, -0.45), (-0.1, -0.09)),
        (f"safety margin r = {p.r:.2f} m", (-1.35, 0.45), (-0.24, 0.18)),
        (f"planning distance $l_{{th}}$ = {p.l_th:.2f} m", (0.62, 0.62), (0.574, 0.175)),
        (f"reference distance $\\sigma_a$ = {p.sigma_a:.2f} m", (0.55, -0.98), (0.55, -0.712)),
    ):
        axes.annotate(text, point, where, arrowprops={"arrowstyle": "-", "color": GREY}, va="center", bbox=box)
    for angle, name in ((9, "I"), (-9, "II"), (62, "III"), (-62, "IV")):
        a = math.radians(angle)
        axes.text(0.49 * math.cos(a), 0.49 * math.sin(a), name, ha="center", va="center", fontsize=12)
    arc = np.radians(np.linspace(-half, half, 50))
    axes.plot(0.36 * np.cos(arc), 0.36 * np.sin(arc), color=RED, lw=1.4)
    axes.annotate(
        f"$\\alpha$ = {2 * half:.0f} deg",
        (0.36 * math.cos(arc[6]), 0.36 * math.sin(arc[6])),
        (0.72, -0.5),
        arrowprops={"arrowstyle": "-", "color": RED},
        color=RED,
        va="center",
        bbox=box,
    )
    axes.set(xlim=(-1.45, 1.75), ylim=(-1.08, 1.08), xlabel="x forward [m]", ylabel="y left [m]", aspect="equal")
    return figure


def scan() -> plt.Figure:
    """Draw a simulated scan with safe directions under both rules, the filtered scan and its features."""
    rig, printed, ranges = forest_scan()
    angles = rig.sensor.angle_min + rig.sensor.increment * np.arange(ranges.size)
    shown = np.minimum(ranges, rig.sensor.range_max)
    safe_default = safe_of(rig, ranges)
    panels = (
        ("printed rule: sector free within $l_{th}$", printed, safe_of(printed, ranges)),
        ("default: footprint, and free up to 2 m", rig, safe_default),
    )
    figure, axes = plt.subplots(1, 3, figsize=(12.5, 4.5), subplot_kw={"projection": "polar"})
    for ax in axes:
        round_the_robot(ax, 5, [1, 2, 3, 4])
        ax.plot(*closed(angles, shown), color=INK, lw=1.0, label="scan")
    for ax, (title, which, safe) in zip(axes, panels, strict=False):
        width = rig.sensor.increment
        ax.bar(
            angles[safe],
            np.full(safe.sum(), 5.0),
            width,
            color=GREEN,
            alpha=0.28,
            lw=0,
            label="safe direction",
        )
        reach = which.look_ahead if which.look_ahead > 0 else which.protection.l_th
        ax.plot(np.linspace(0, 2 * math.pi, 200), np.full(200, reach), color=RED, lw=1.1, ls="--")
        ax.set_title(f"{title}\n{safe.sum()} of {safe.size} directions", fontsize=10.5)
    filtered = filtered_by(rig.taps, rig, ranges, rig.sensor.range_max)
    at, distance = features_of(rig, filtered, safe_of(rig, ranges, PRINTED), MASK_MAXIMA)
    ax = axes[2]
    ax.plot(*closed(angles, filtered), color=BLUE, lw=1.8, label="filtered scan $y_2$")
    ax.plot(*closed(at, distance), color=ORANGE, lw=1.0, ls="--")
    ax.plot(at, distance, "o", color=ORANGE, ms=6, label="features")
    ax.set_title(f"what is sent: {at.size} features\n{12 + 2 * at.size} bytes", fontsize=10.5)
    handles = {}
    for ax in axes:
        handles |= {label: handle for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    figure.legend(handles.values(), handles.keys(), loc="lower center", ncols=4, frameon=False)
    figure.subplots_adjust(bottom=0.1, wspace=0.25)
    return figure


def filters() -> plt.Figure:
    """Draw the taps, step answers and responses of both filters, for several Kaiser parameters."""
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13.0, 4.2))
    n = np.arange(-HALF, HALF + 1)
    box = scope_filter(HALF).astype(float)
    left.step(n, box, where="mid", color=GREY, lw=1.5, label="$h_1$ (4)")
    middle.plot(n, np.cumsum(box), color=GREY, lw=1.5)
    db, frequency = response_db(box)
    right.plot(frequency, db, color=GREY, lw=1.0)
    colours = plt.get_cmap("viridis")(np.linspace(0.0, 0.85, len(BETAS)))
    for beta, colour in zip(BETAS, colours, strict=True):
        taps = feature_filter(HALF, beta).astype(float)
        chosen = beta == KAISER_BETA
        look: dict[str, Any] = {"color": RED if chosen else colour, "lw": 2.4 if chosen else 1.1}
        left.plot(n, taps, label=f"$h_2$ (6), beta {beta:g}{' (ours)' if chosen else ''}", **look)
        middle.plot(n, np.cumsum(taps), **look)
        db, frequency = response_db(taps)
        right.plot(frequency, db, **look)
    left.set(title="taps", xlabel="beam [deg]", ylim=(0, None))
    left.legend(fontsize=8, loc="upper left", frameon=False)
    left.set_ylim(0, 0.062)
    middle.set(title="answer to a step: none overshoots", xlabel="beam [deg]")
    right.axvline(1.0 / (2 * HALF), color="#222222", lw=0.9, ls=":")
    right.text(1.0 / (2 * HALF) + 0.001, 3, "$f_c = 1/T_c$", fontsize=9)
    right.axhline(-6.02, color="#222222", lw=0.9, ls=":")
    right.text(0.0995, -5.3, "half", fontsize=9, ha="right", va="bottom")
    right.set(title="response [dB]", xlabel="frequency [cycles per beam]", xlim=(0, 0.1), ylim=(-80, 8))
    figure.tight_layout()
    return figure


def field() -> plt.Figure:
    """Draw the interaction field for the published weights, with the pass band."""
    sigma = protection_model(Body()).sigma_a
    distance = np.linspace(0.55, 3.6, 600)
    figure, axes = plt.subplots(figsize=(7.6, 4.2))
    axes.axvspan(sigma, 3 * sigma, color=GREEN, alpha=0.12, lw=0)
    axes.text(2 * sigma, 0.79, "pass band: features are fused", ha="center", color=GREEN)
    axes.text(0.88, 0.79, "repulsion", color=RED, ha="right", fontsize=9)
    colours = plt.get_cmap("viridis")(np.linspace(0.0, 0.85, 5))
    for w_i, colour in zip((0.25, 0.5, 1.0, 2.0, 4.0), colours, strict=True):
        force = [interaction_force(d, sigma, w_i) for d in distance]
        chosen = w_i == 1.0
        label = f"$w_i$ = {w_i:g}{' (ours)' if chosen else ''}"
        axes.plot(distance, force, color=RED if chosen else colour, lw=2.4 if chosen else 1.2, label=label)
    axes.axhline(0.0, color="#222222", lw=0.8)
    axes.axhline(0.193, color="#222222", lw=0.9, ls=":")
    axes.text(3.58, 0.2, "AdaBoost optimum 0.193 (21)", ha="right", va="bottom", fontsize=8.5)
    axes.set(xlim=(0.55, 3.6), ylim=(-1.0, 0.9), xlabel="distance to the neighbour [m]", ylabel="force [1/m]")
    axes.set_xticks([sigma, 2 * sigma, 3 * sigma], ["$\\sigma_a$ = 0.9", "$2\\sigma_a$ = 1.8", "$3\\sigma_a$ = 2.7"])
    axes.legend(loc="lower right", frameon=False)
    return figure


def with_borders(angles: np.ndarray, distances: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, int]:
    """Return the features with the values at the quadrants' borders among them."""
    borders = np.mod([0.0, TABLE_HALF, -TABLE_HALF, 0.5 * math.pi, -0.5 * math.pi], 2 * math.pi)
    at = np.append(angles, borders)
    values = np.append(distances, [reconstruct(angles, distances, count, b, False) for b in borders])
    order = np.argsort(at)
    return at[order], values[order], at.size


def decision() -> plt.Figure:
    """Draw the three polygons of the worked decision with their quadrants."""
    figure, axes = plt.subplots(1, 3, figsize=(12.5, 4.9), subplot_kw={"projection": "polar"})
    titles = {
        "R3": "R3 decides: areas of I to IV\n$P_s$ = 0.5042",
        "R2": "R2, on its left: passable distances\n$P_{n2}$ = 0.581",
        "R4": "R4, on its right: passable distances\n$P_{n4}$ = 0.4137",
    }
    degrees = np.degrees(TABLE_HALF)
    for ax, name in zip(axes, ("R3", "R2", "R4"), strict=True):
        angles, distances, count = table_features(name)
        own, chords = name == "R3", name == "R4"
        vertices = angles, distances, count
        if own:  # triangles between the features and the quadrants' borders
            vertices = with_borders(angles, distances, count)
        phi = np.linspace(0, 2 * math.pi, 721)
        ax.plot(phi, [reconstruct(*vertices, p, own or chords) for p in phi], color="#222222", lw=1.1)
        for low, high, colour in QUADRANTS[: 4 if own else 2]:
            part = np.radians(np.linspace(low, high, 80))
            d = [reconstruct(*vertices, p % (2 * math.pi), own or chords) for p in part]
            ax.fill_between(part, 0, d, color=colour, alpha=0.3 if abs(low + high) <= 36 else 0.14, lw=0)
        ax.plot(angles, distances, "o", color="#222222", ms=4)
        if not own:
            for low, high, sign, colour in ((0.0, TABLE_HALF, 1, BLUE), (-TABLE_HALF, 0.0, -1, ORANGE)):
                x = passable_distance(angles, distances, count, low, high, chords)
                ax.plot(np.radians(np.linspace(0, sign * degrees, 30)), np.full(30, x), color=colour, lw=2.6)
                ax.text(
                    sign * math.radians(52),
                    2.32,
                    f"{x:.3f}",
                    color=colour,
                    ha="center",
                    va="center",
                    fontsize=11,
                )
            ax.plot(np.radians(np.linspace(-degrees, degrees, 60)), np.full(60, 1.54), color=RED, lw=1.2, ls="--")
        ax.set_theta_zero_location("N")
        ax.set_rlim(0, 2.0)
        ax.set_rticks([1.0, 1.5, 2.0])
        ax.set_rlabel_position(200)
        ax.set_xticks(np.radians([0, 90, 180, 270]))
        ax.set_xticklabels(["target", "left", "", "right"])
        ax.tick_params(labelsize=8.5)
        ax.set_title(titles[name], fontsize=10.5)
    figure.tight_layout()
    return figure


FIGURES: dict[str, Callable[[], plt.Figure]] = {
    "protection": protection,
    "scan": scan,
    "filters": filters,
    "chain": chain,
    "field": field,
    "decision": decision,
    "playground": playground,
    "paths": paths,
    "convergence": convergence,
    "divergence": divergence,
}


def main(folder: Path, only: Collection[str] = ()) -> None:
    """Write every figure, or ``only`` some, into ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in only or FIGURES:
        draw = FIGURES[name]
        with mpl.rc_context(STYLE):
            figure = draw()
            figure.savefig(folder / f"{name}.png", bbox_inches="tight", metadata={"Software": None})
            plt.close(figure)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "figures", sys.argv[2:])

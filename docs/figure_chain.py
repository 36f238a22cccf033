"""The scans of docs/theory.md: one with both rules, and the chain from a scan to what a receiver makes of it."""

from __future__ import annotations

import math
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from figure_style import BLUE, GREEN, GREY, INK, ORANGE, RED, closed, round_the_robot

from swarmscope.onboard.perception.features import MASK_MAXIMA, UNMASKED, align_features, extrema, reconstruct
from swarmscope.onboard.perception.features import what_counts as count_kinds
from swarmscope.onboard.perception.filters import filter_padded, prepare_scan, scope_filter
from swarmscope.onboard.perception.safety import safe_directions
from swarmscope.onboard.rig import AHEAD, PRINTED, Rig
from swarmscope.onboard.sharing.feature_message import FeatureMessage
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_rig_of
from swarmscope.sim.beams import make_beams
from swarmscope.sim.lidar import cast_static
from swarmscope.sim.world import compile_world

Features = tuple[np.ndarray, np.ndarray]
SCAN_POSE = (12.0, 13.35, 0.0)
"""Where the scan of the figure of both rules is taken in the reference forest (T1, seed 0): x, y [m], yaw [rad]."""
CHAIN_POSE = (4.08, 2.47, 0.0)
"""Where that of the chain is taken: a robot with the printed rules has to choose a side there."""
PRINTED_KEYS = {"safety": {"sector": True, "look_ahead_m": 0.0}, "features": {"filter": "printed"}}
REACH_M = 6.0
"""How far out panels go: the side lobes of M taps lift the filtered scan above the LiDAR's 5 m."""


def forest_scan(pose: tuple[float, float, float] = SCAN_POSE) -> tuple[Rig, Rig, np.ndarray]:
    """Return the default rig, the one with rule and filter as printed, and a scan [m] of the forest (T1, seed 0)."""
    values = {"task": {"name": "T1"}, "seed": 0}
    scenario = parse_scenario(values, "figure")
    printed = parse_scenario(values | PRINTED_KEYS, "figure")
    lidar = scenario.lidar
    world = compile_world(make_setup(scenario).world)
    ranges = np.full(lidar.beams, np.inf, np.float32)
    cast_static(world, *pose, make_beams(lidar.beams, math.radians(lidar.fov_deg), lidar.range_m), ranges)
    return make_rig_of(scenario), make_rig_of(printed), ranges


def safe_of(rig: Rig, ranges: np.ndarray, rule: int = AHEAD) -> np.ndarray:
    """Return the safe directions of a scan as booleans; rule PRINTED masks the features."""
    edges, safe = np.zeros(ranges.size + 1, np.int16), np.zeros(ranges.size, np.uint8)
    safe_directions(ranges, rig.sensor, rig.reach[-1, rule], edges, safe)
    return safe.astype(bool)


def filtered_by(taps: np.ndarray, rig: Rig, ranges: np.ndarray, range_max: float) -> np.ndarray:
    """Return the scan, truncated to ``range_max`` [m], through a filter [m]."""
    half = taps.size // 2
    padded, out = np.zeros(ranges.size + 2 * half, np.float32), np.zeros(ranges.size, np.float32)
    prepare_scan(ranges, rig.sensor.range_min, range_max, rig.sensor.wraps, half, padded)
    filter_padded(padded, taps, range_max, out)
    return out


def features_of(rig: Rig, filtered: np.ndarray, safe: np.ndarray, mask: int) -> Features:
    """Return angles [rad] and distances [m] of the extrema of a filtered scan that ``mask`` leaves."""
    counts, angles, distances = safe.astype(np.uint8), np.zeros(16), np.zeros(16)
    count_kinds(mask, counts)
    n = extrema(filtered, counts, rig.sensor, angles, distances)
    return angles[:n], distances[:n]


class Chain(NamedTuple):
    """What becomes of one scan of M beams, step by step; lengths in m, angles in rad, local frame."""

    angles: np.ndarray
    """(M,) of the beams."""
    scan: np.ndarray
    """(M,) (i), no return as the LiDAR's range."""
    l_th: float
    truncated: np.ndarray
    """(M,) within l_th, and ..."""
    response: np.ndarray
    """(M,) ... through h_1, (ii)."""
    safe: np.ndarray
    """(M,) booleans, (iii)."""
    filtered: np.ndarray
    """(M,) through h_2 with M taps, (iv)."""
    extrema: Features
    """(v)."""
    kept: Features
    """(vi)."""
    sent: Features
    """As the receiver unpacks them, (vii)."""
    packet_bytes: int
    rebuilt: np.ndarray
    """(M,) straight lines between what was sent, (viii)."""


def chain_of(pose: tuple[float, float, float] = CHAIN_POSE) -> Chain:
    """Run the steps (i) to (viii) of Nav-SCOPE Fig. 3 on one scan, with the printed rule (3) and M taps."""
    _, rig, ranges = forest_scan(pose)
    sensor, l_th = rig.sensor, float(rig.protection.l_th)
    angles = sensor.angle_min + sensor.increment * np.arange(ranges.size)
    h_1 = scope_filter(round(0.5 * rig.protection.alpha / sensor.increment))
    safe = safe_of(rig, ranges, PRINTED)
    filtered = filtered_by(rig.taps, rig, ranges, sensor.range_max)
    kept = features_of(rig, filtered, safe, MASK_MAXIMA)
    packet = FeatureMessage(1, 0, 0, 0, tuple(kept[0]), tuple(kept[1])).pack(sensor.range_max)
    heard = FeatureMessage.unpack(packet, sensor.range_max)
    at, distance, n = np.array(heard.angles), np.array(heard.distances), len(heard.angles)
    sorted_at, sorted_d = np.zeros(n), np.zeros(n)
    align_features(at, distance, n, 0.0, sorted_at, sorted_d)
    return Chain(
        angles=angles,
        scan=np.minimum(ranges, sensor.range_max),
        l_th=l_th,
        truncated=np.minimum(ranges, l_th),
        response=filtered_by(h_1, rig, ranges, l_th),
        safe=safe,
        filtered=filtered,
        extrema=features_of(rig, filtered, safe, UNMASKED),
        kept=kept,
        sent=(sorted_at, sorted_d),
        packet_bytes=len(packet),
        rebuilt=np.array([reconstruct(sorted_at, sorted_d, n, float(a % (2 * math.pi)), False) for a in angles]),
    )


def chain() -> plt.Figure:
    """Draw the steps (i) to (viii) in one row of panels for what is safe and one for what is told."""
    steps = chain_of()
    figure = plt.figure(figsize=(14.0, 8.0))
    grid = figure.add_gridspec(2, 4, wspace=0.28, hspace=0.36)
    panels = [figure.add_subplot(grid[k // 4, k % 4], projection=None if k == 1 else "polar") for k in range(8)]
    for k, ax in enumerate(panels):
        if k != 1:
            round_the_robot(ax, REACH_M, [1, 2, 3, 4, 5])
            own_scan: dict[str, object] = {"color": INK, "lw": 1.2} if k == 0 else {"color": "#aaaaaa", "lw": 0.9}
            ax.plot(*closed(steps.angles, steps.scan), **own_scan)
    _title(panels[0], "(i) scan $s(n)$", f"{steps.scan.size} beams, up to {steps.scan.max():.0f} m")
    _draw_response(panels[1], steps)
    _draw_safe(panels[2], steps, 0.28)
    _title(panels[2], r"(iii) safe directions $\Theta_s$", f"{steps.safe.sum()} of {steps.safe.size}")
    for ax in panels[3:7]:
        ax.plot(*closed(steps.angles, steps.filtered), color=BLUE, lw=1.6)
    _title(panels[3], "(iv) filtered by $h_2$", "$y_2$ (blue), M taps")
    panels[4].plot(*steps.extrema, "o", color=ORANGE, ms=6)
    _title(panels[4], "(v) extrema of $y_2$", f"{steps.extrema[0].size} extrema")
    _draw_mask(panels[5], steps)
    _draw_features(panels[6], steps.sent, None)
    _title(panels[6], r"(vii) sent: $\Sigma$", f"{steps.sent[0].size} features, {steps.packet_bytes} bytes")
    panels[7].fill(*closed(steps.angles, steps.rebuilt), color=ORANGE, alpha=0.15, lw=0)
    _draw_features(panels[7], steps.sent, steps)
    _title(panels[7], "(viii) what the receiver makes of it", "over the true scan (grey)")
    return figure


def _title(ax: plt.Axes, first: str, second: str) -> None:
    ax.set_title(f"{first}\n{second}", fontsize=10.5)


def _draw_response(ax: plt.Axes, steps: Chain) -> None:
    """Draw the truncated scan and its moving average [m] over the angle [deg], and the threshold."""
    degrees = np.degrees(steps.angles)
    ax.axhline(steps.l_th, color=RED, lw=1.1, ls="--")
    ax.text(176, steps.l_th + 0.01, f"$l_{{th}}$ = {steps.l_th:.2f} m", color=RED, fontsize=9, va="bottom")
    ax.plot(degrees, steps.truncated, color=GREY, lw=0.9, label=r"truncated scan $\tilde s$")
    ax.plot(degrees, steps.response, color=BLUE, lw=1.8, label=r"$y_1 = h_1 * \tilde s$")
    ax.fill_between(degrees, 0.0, 0.02, where=steps.safe, color=GREEN, lw=0, label="$y_1$ reaches $l_{th}$: safe")
    ax.set(xlim=(180, -180), ylim=(0, 0.72), xlabel="direction, left of the target [deg]")
    ax.set_box_aspect(0.78)
    ax.set_xticks([180, 90, 0, -90, -180])
    ax.tick_params(labelsize=8.5)
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 0.06), fontsize=8.5, frameon=True, framealpha=0.9)
    _title(ax, "(ii) truncated scan through $h_1$", r"[m], window $\alpha$")


def _draw_safe(ax: plt.Axes, steps: Chain, alpha: float) -> None:
    """Fill the safe directions of a polar panel."""
    width = float(steps.angles[1] - steps.angles[0])
    ax.bar(steps.angles[steps.safe], np.full(steps.safe.sum(), REACH_M), width, color=GREEN, alpha=alpha, lw=0)


def _draw_mask(ax: plt.Axes, steps: Chain) -> None:
    """Mark the extrema that stay and, as crosses, the maxima in directions that are not safe."""
    _draw_safe(ax, steps, 0.16)
    stays = np.isin(steps.extrema[0], steps.kept[0])
    ax.plot(*steps.kept, "o", color=ORANGE, ms=6)
    ax.plot(steps.extrema[0][~stays], steps.extrema[1][~stays], "x", color=RED, ms=9, mew=2.2)
    _title(ax, r"(vi) maxima masked by $\Theta_s$", f"{(~stays).sum()} maxima fall out (crosses)")


def _draw_features(ax: plt.Axes, features: Features, steps: Chain | None) -> None:
    """Mark features and, with ``steps``, the reconstruction through them."""
    if steps is not None:
        ax.plot(*closed(steps.angles, steps.rebuilt), color=ORANGE, lw=1.6)
    ax.plot(*features, "o", color=ORANGE, ms=6)

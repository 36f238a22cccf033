"""Makes a small run folder that looks like a real one: a simple swarm walks through a simple world."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from pathlib import Path

import numpy as np

STATES = ["advance", "decide", "follow", "yield", "arrived", "stuck", "crashed"]
REASONS = [
    "the way to the goal is free",
    "an obstacle is in the way: asked the neighbours for a side",
    "follows the obstacle on the chosen side",
    "waits for a neighbour with priority",
    "has reached its goal",
    "touched an obstacle",
]
RADIUS = 0.15
RANGE_MAX = 4.0
STEP_S = 0.4
SPEED = 0.5
HALF_WINDOW = math.radians(30.0)
LOOK_AHEAD = 0.7

CIRCLES = np.array(
    [
        [3.0, 1.6, 0.35],
        [3.4, 4.1, 0.45],
        [4.7, 2.7, 0.4],
        [5.6, 5.6, 0.5],
        [6.4, 1.2, 0.3],
        [8.6, 4.2, 0.45],
        [8.2, 2.3, 0.3],
        [2.2, 6.3, 0.3],
        [9.7, 5.8, 0.3],
        [9.9, 1.5, 0.25],
    ]
)
POLYGON = [[6.2, 3.2], [7.1, 3.0], [7.4, 3.9], [6.7, 4.4], [6.1, 4.0]]
WALL = [[4.2, 6.2], [4.9, 6.9], [5.4, 7.6]]
GRID_RESOLUTION, GRID_ORIGIN = 0.2, (7.4, 5.6)
GRID_ROWS = [[0, 0, 4], [1, 0, 4], [2, 0, 1], [3, 0, 1]]
BOUNDS = [0.0, 0.0, 12.0, 8.0]


def make_fake_run(
    folder: Path,
    robots: int = 6,
    ticks: int = 60,
    beams: int = 72,
    scans: bool = True,
    crashed: int | None = None,
    seed: int = 7,
) -> Path:
    """Write the files of the contract into ``folder``; ``crashed`` is a robot that collides half way."""
    folder.mkdir(parents=True, exist_ok=True)
    starts, goals = _places(robots, seed)
    arrays = _walk(starts, goals, ticks, beams, crashed)
    if not scans:
        arrays["scan_u8"] = np.zeros((0, robots, beams), np.uint8)
        arrays["safe_bits"] = np.zeros((0, robots, (beams + 7) // 8), np.uint8)
    np.savez_compressed(folder / "trajectory.npz", **arrays)
    (folder / "world.json").write_text(json.dumps(_world(starts, goals)))
    (folder / "config.yaml").write_text("task: T1\n...\n")
    (folder / "metrics.json").write_text(json.dumps(_metrics(arrays, robots, seed)))
    return folder


def _places(robots: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    ys = np.linspace(0.7, 7.3, robots)
    starts = np.column_stack([np.full(robots, 0.6), ys, rng.uniform(-0.3, 0.3, robots)])
    return starts, np.column_stack([np.full(robots, 11.4), ys + rng.uniform(-0.2, 0.2, robots)])


def _segments() -> np.ndarray:
    rows = []
    for line in ([*POLYGON, POLYGON[0]], WALL):
        rows += [[*a, *b] for a, b in pairwise(line)]
    x0, y0 = GRID_ORIGIN
    for row, first, last in GRID_ROWS:
        left, right = x0 + first * GRID_RESOLUTION, x0 + (last + 1) * GRID_RESOLUTION
        low = y0 + row * GRID_RESOLUTION
        high = low + GRID_RESOLUTION
        box = [[left, low], [right, low], [right, high], [left, high], [left, low]]
        rows += [[*a, *b] for a, b in pairwise(box)]
    return np.array(rows)


def _cast(x: float, y: float, angles: np.ndarray, discs: np.ndarray) -> np.ndarray:
    """Return the ranges along world ``angles``, inf without a return."""
    ux, uy = np.cos(angles)[:, None], np.sin(angles)[:, None]
    cx, cy = discs[:, 0] - x, discs[:, 1] - y
    along, aside = ux * cx + uy * cy, ux * cy - uy * cx
    root = discs[:, 2] ** 2 - aside**2
    hits = np.where((root >= 0) & (along > 0), along - np.sqrt(np.maximum(root, 0)), np.inf)
    segments = _segments()
    ax, ay = segments[:, 0] - x, segments[:, 1] - y
    dx, dy = segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1]
    cross = ux * dy - uy * dx
    with np.errstate(divide="ignore", invalid="ignore"):
        reach, share = (ax * dy - ay * dx) / cross, (ax * uy - ay * ux) / cross
    walls = np.where((reach > 0) & (share >= 0) & (share <= 1), reach, np.inf)
    ranges = np.minimum(hits.min(axis=1), walls.min(axis=1))
    return np.where(ranges <= RANGE_MAX, ranges, np.inf)


def _safe(ranges: np.ndarray, angles: np.ndarray) -> np.ndarray:
    gap = np.abs((angles[:, None] - angles + math.pi) % (2 * math.pi) - math.pi)
    swept = np.arcsin(np.minimum(1.0, (RADIUS + 0.08) / np.maximum(ranges, 1e-6)))
    half = np.where(ranges < LOOK_AHEAD, np.minimum(np.maximum(HALF_WINDOW, swept), 1.4), -1.0)
    return ~np.any(gap <= half, axis=1)


def _walk(starts, goals, ticks, beams, crashed) -> dict[str, np.ndarray]:
    n = len(starts)
    shape = (ticks, n)
    a = {name: np.zeros(shape) for name in ("x_m", "y_m", "yaw_rad")}
    a |= {name: np.zeros(shape, np.float32) for name in ("speed_mps", "clearance_m")}
    a |= {name: np.zeros(shape, np.uint8) for name in ("state", "reason", "neighbours")}
    a |= {"p_left": np.full(shape, np.nan, np.float32), "side": np.zeros(shape, np.int8)}
    a |= {"bytes_sent": np.zeros(shape, np.int32), "scan_u8": np.zeros((*shape, beams), np.uint8)}
    a |= {"safe_bits": np.zeros((*shape, (beams + 7) // 8), np.uint8)}
    beam_angles = -math.pi + np.arange(beams) * 2 * math.pi / beams
    pose, side = starts.copy(), np.zeros(n, int)
    p_left, sent = np.full(n, np.nan), np.zeros(n, int)
    arrival, links, choices, opinions = np.full(n, np.nan), [], [], []
    for k in range(ticks):
        before = pose.copy()
        for i in range(n):
            x, y, yaw = before[i]
            others = np.delete(before, i, axis=0)
            discs = np.vstack([CIRCLES, np.column_stack([others[:, :2], np.full(n - 1, RADIUS)])])
            ranges = _cast(x, y, yaw + beam_angles, discs)
            safe = _safe(ranges, beam_angles)
            scaled = np.minimum(254, np.round(np.where(np.isfinite(ranges), ranges, 0) / RANGE_MAX * 254))
            a["scan_u8"][k, i] = np.where(np.isfinite(ranges), scaled, 255)
            a["safe_bits"][k, i] = np.packbits(safe)
            distance = np.hypot(*(before[:, :2] - before[i, :2]).T)
            a["neighbours"][k, i] = np.count_nonzero(distance < RANGE_MAX) - 1
            a["clearance_m"][k, i] = min(RANGE_MAX, ranges.min()) - RADIUS
            to_goal = goals[i] - pose[i, :2]
            left = math.hypot(*to_goal)
            bearing = math.atan2(to_goal[1], to_goal[0])
            off = np.abs((beam_angles + yaw - bearing + math.pi) % (2 * math.pi) - math.pi)
            free = safe[off.argmin()]
            ahead = [j for j in range(i) if distance[j] < 0.42 and before[j, 0] >= x]
            speed, state = SPEED, 0
            if crashed == i and k >= ticks // 2:
                speed, state, reason = 0.0, 6, 5
            elif left < 0.15 or np.isfinite(arrival[i]):
                speed, state, reason = 0.0, 4, 4
                arrival[i] = k * STEP_S if np.isnan(arrival[i]) else arrival[i]
            elif ahead:
                speed, state, reason = 0.0, 3, 3
            elif free:
                side[i], reason = 0, 0
            elif side[i] == 0:
                p_left[i] = 0.5 + 0.4 * math.sin(3.7 * i + 0.9 * k)
                side[i] = 1 if p_left[i] >= 0.5 else -1
                state, reason = 1, 1
                choices.append([k, i, 0.5, p_left[i], side[i], 0])
                for j in np.flatnonzero((distance > 0.9) & (distance < 2.7)):
                    size = 18 + 4 * int(np.count_nonzero(np.diff(ranges[np.isfinite(ranges)]) > 0.2))
                    links.append([k, j, i, size])
                    sent[j] += size
                    choices[-1][-1] += 1
                    opinions.append([len(choices) - 1, j, 1 if j > i else -1, 0.25 + 0.125 * (j % 5), 0.5])
            else:
                state, reason = 2, 2
            if speed:
                turn = (beam_angles + yaw - bearing + math.pi) % (2 * math.pi) - math.pi
                cost = np.abs(turn) + (0.8 * (turn * side[i] < 0) if side[i] else 0.0)
                cost = cost + np.where(safe, 0.0, 10.0)
                heading = bearing if free else yaw + beam_angles[cost.argmin()]
                step = min(SPEED * STEP_S, left)
                pose[i] = [x + step * math.cos(heading), y + step * math.sin(heading), heading]
            for name, value in (("x_m", x), ("y_m", y), ("yaw_rad", yaw), ("speed_mps", speed)):
                a[name][k, i] = value
            for name, value in (("state", state), ("reason", reason), ("side", side[i])):
                a[name][k, i] = value
            a["p_left"][k, i], a["bytes_sent"][k, i] = p_left[i], sent[i]
    collided = np.zeros(n, np.uint8)
    if crashed is not None:
        collided[crashed] = 1
    return a | {
        "t_s": np.arange(ticks) * STEP_S,
        "beam_angles": beam_angles,
        "state_names": np.array(STATES),
        "reason_names": np.array(REASONS),
        "links": np.array(links, np.int32).reshape(-1, 4),
        "choices": np.array(choices, float).reshape(-1, 6),
        "opinions": np.array(opinions, float).reshape(-1, 5),
        "arrival_s": arrival,
        "collided": collided,
        "range_max_m": np.array(RANGE_MAX),
    }


def _world(starts: np.ndarray, goals: np.ndarray) -> dict:
    obstacles: list[dict] = [
        {"type": "circle", "center": row[:2], "radius": row[2]} for row in CIRCLES.tolist()
    ]
    obstacles.append({"type": "polygon", "points": POLYGON})
    obstacles.append({"type": "wall", "points": WALL})
    grid = {"type": "grid", "resolution": GRID_RESOLUTION, "origin": GRID_ORIGIN, "width": 5, "height": 4}
    obstacles.append(grid | {"rows": GRID_ROWS})
    robots = [
        {"id": i, "radius": RADIUS, "start": starts[i].tolist(), "goal": goals[i].tolist()}
        for i in range(len(starts))
    ]
    return {"frame": "world", "robots": robots, "obstacles": obstacles, "bounds": BOUNDS}


def _metrics(arrays: dict[str, np.ndarray], robots: int, seed: int) -> dict:
    return {
        "run": {"task": "T1", "planner": "nav-scope", "robots": robots, "seed": seed},
        "arrival_rate": float(np.mean(np.isfinite(arrays["arrival_s"]))),
        "path_redundancy": 0.083,
        "collisions": int(arrays["collided"].sum()),
        "duration_s": float(arrays["t_s"][-1]),
        "bytes_sent": int(arrays["bytes_sent"][-1].sum()),
        "failures": [{"robot": int(i), "why": "collided"} for i in np.flatnonzero(arrays["collided"])],
        "versions": {"swarmscope": "0.1.0"},
    }

"""Robots among discs that move and do not yield: python benchmarks/moving.py [--runs 0-199] [--planner nav-scope]

Every run draws a hall of 12 x 12 m with posts and 4 to 8 discs of 0.2 to 0.4 m that go to and fro, round and round or
straight on at 0.2 to 2 m/s, and 3 robots of 0.5 to 1 m/s that cross it. Whenever a disc and a robot touch, the robot
has to stand: a robot that drives then counts as collided.
"""

from __future__ import annotations

import argparse
import math

import numpy as np
from rich.console import Console
from rich.progress import track

from swarmscope.api import simulate
from swarmscope.errors import SwarmscopeError
from swarmscope.geometry import point_segment_distance
from swarmscope.judging.statistics import wilson
from swarmscope.sim.moving import moving_in
from swarmscope.sim.world import Circle, WorldSpec

SIDE_M, ROBOTS, LIMIT_S = 12.0, 3, 600.0
Obstacle = dict[str, object]


def drawn(seed: int) -> dict[str, object]:
    """Return the scenario of a run."""
    rng = np.random.default_rng([seed, 77])
    starts, goals = _across(rng), _across(rng)
    discs = [_disc(rng) for _ in range(int(rng.integers(4, 9)))]
    posts: list[Obstacle] = []
    while len(posts) < 8:
        x, y = rng.uniform(1.0, SIDE_M - 1.0, 2).tolist()
        free = min(math.dist((x, y), place) for place in (*starts, *goals)) > 1.0
        if free and all(_off_way((x, y), disc) > 0.9 for disc in discs):
            posts.append({"type": "circle", "center": (x, y), "radius": float(rng.uniform(0.15, 0.4))})
    walls = [(0.0, 0.0), (SIDE_M, 0.0), (SIDE_M, SIDE_M), (0.0, SIDE_M), (0.0, 0.0)]
    obstacles = [*posts, *discs, {"type": "wall", "points": walls}]
    facing = [math.atan2(g[1] - s[1], g[0] - s[0]) for s, g in zip(starts, goals, strict=True)]
    place = {
        "world": {"bounds": (0.0, 0.0, SIDE_M, SIDE_M), "obstacles": obstacles},
        "starts": [(*start, yaw) for start, yaw in zip(starts, facing, strict=True)],
        "goals": goals,
    }
    v = float(rng.uniform(0.5, 1.0))
    robot = {"v_max_mps": v, "a_max_mps2": float(rng.uniform(0.5, 2.0))}
    return {"place": place, "robots": ROBOTS, "seed": seed, "robot": robot, "limit_s": LIMIT_S, "record_scans": "no"}


def _across(rng: np.random.Generator) -> list[tuple[float, float]]:
    """Return a place for each robot, 2 m apart or more."""
    places: list[tuple[float, float]] = []
    while len(places) < ROBOTS:
        place = tuple(rng.uniform(0.6, SIDE_M - 0.6, 2).tolist())
        if all(math.dist(place, other) > 2.0 for other in places):
            places.append(place)
    return places


def _off_way(place: tuple[float, float], disc: Obstacle) -> float:
    """Return how far a place is from where the centre of a disc comes [m]: discs do not walk through posts."""
    legs = moving_in(WorldSpec(obstacles=[Circle.model_validate(disc)], bounds=(0.0, 0.0, SIDE_M, SIDE_M))).legs
    ends = np.vstack([legs[1:, :3], legs[:1, :3]])
    ends[:, 0] = np.where(ends[:, 0] > legs[:, 0], ends[:, 0], legs[:, 0] + 100.0)
    until = legs[:, 1:3] + legs[:, 3:] * (ends[:, :1] - legs[:, :1])
    pieces = zip(legs[:, 1:3].tolist(), until.tolist(), strict=True)
    return min(point_segment_distance(*place, *a, *b) for a, b in pieces)


def _disc(rng: np.random.Generator) -> Obstacle:
    """Return a disc on a way of its own."""
    speed, radius = float(rng.uniform(0.2, 2.0)), float(rng.uniform(0.2, 0.4))
    points = [tuple(p) for p in rng.uniform(1.0, SIDE_M - 1.0, (4, 2)).tolist()]
    repeat = ("back", "loop")[int(rng.integers(2))]
    if rng.random() < 0.2:
        angle = float(rng.uniform(-math.pi, math.pi))
        velocity = (speed * math.cos(angle), speed * math.sin(angle))
        return {"type": "circle", "center": points[0], "radius": radius, "velocity": velocity}
    about = {"center": points[0], "radius": radius, "way": points[1:], "speed_mps": speed, "repeat": repeat}
    return {"type": "circle", **about}


def main() -> None:
    """Run them and print what came out."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", default="0-199", help="first-last")
    parser.add_argument("--planner", default="nav-scope")
    chosen = parser.parse_args()
    first, _, last = chosen.runs.partition("-")
    numbers = range(int(first), int(last or first) + 1)
    robots = arrived = collided = walked_into = refused = 0
    for seed in track(numbers, console=Console(stderr=True)):
        try:
            run = simulate(drawn(seed), planner=chosen.planner, progress=False)
        except SwarmscopeError as error:
            refused += 1
            print(f"{seed}: {error}")
            continue
        robots += ROBOTS
        arrived += int(np.isfinite(run.trace.arrival_s).sum())
        collided += int(run.metrics["collisions"])
        walked_into += int(run.metrics["walked_into"])
        if run.metrics["collisions"] or run.metrics["planning_failures"]:
            print(f"{seed}: {[failure['why'] for failure in run.metrics['failures']]}")
    interval = wilson(arrived, robots)
    print(f"{chosen.planner}: {len(numbers) - refused} runs, {refused} refused, {robots} robots")
    print(f"arrived {arrived} ({arrived / robots:.1%}, 95 % {interval.low:.1%} to {interval.high:.1%})")
    print(f"walked into while they stood: {walked_into} times; touched something while they drove: {collided}")


if __name__ == "__main__":
    main()

"""The planned controller: ways past points, delays, plans without contacts, and what it does when nothing helps."""

import math

import numpy as np
import pytest

from swarmscope.disk import bounds, maps, random_maps, rules, runs
from swarmscope.disk.controllers import _elastic, _paths, _schedule, find
from swarmscope.disk.find_map import find_map

NO_DISCS = np.empty((0, 3))


def play(name, permutations, **numbers):
    of = runs.problem(rules.Rules(n=len(permutations[0])), [find_map(name, rules.Rules())], permutations)
    kind = find("planned", numbers)
    return of, runs.play(of, kind.create(of, kind.params))


def test_everybody_across_the_middle_at_once():
    of, outcome = play("one-disc", [(0, 1, 2, 3, 4)])
    assert outcome.status.tolist() == [runs.ARRIVED]
    assert bounds.bound(of)[0] < outcome.steps[0] < 1.03 * bounds.bound(of)[0]
    assert outcome.robot_gap[0] > 0 and outcome.obstacle_gap[0] > 0


def test_who_is_not_in_anybodys_way_needs_the_bound():
    of, outcome = play("empty", [(4, 3, 2, 1, 0)])
    assert outcome.status.tolist() == [runs.ARRIVED]
    assert bounds.bound(of)[0] <= outcome.steps[0] <= bounds.bound(of)[0] + 1


def test_plans_depend_on_nothing_but_the_run():
    both, alone = [(0, 1, 2, 3, 4), (1, 0, 2, 4, 3)], [(1, 0, 2, 4, 3)]
    _, one = play("minima", both, attempts=1, iterations=20)
    _, two = play("minima", alone, attempts=1, iterations=20)
    for first, second in zip(one, two, strict=True):
        assert np.array_equal(first[1:], second)


def test_random_cases_arrive_without_contact():
    for n in (5, 12):
        scaled = rules.scaled(n)
        cases = [random_maps.random_map(seed, scaled) for seed in (20026, 20094)]
        of = runs.Problem(
            scaled, tuple(case.map for case in cases), np.arange(2), np.array([case.permutation for case in cases])
        )
        kind = find("planned", {"attempts": 1, "iterations": 20, "sweeps": 200, "finish": 0})
        outcome = runs.play(of, kind.create(of, kind.params))
        assert outcome.status.tolist() == [runs.ARRIVED] * 2
        assert (outcome.steps < 1.1 * bounds.bound(of)).all()


def test_who_has_no_way_stays_and_nobody_collides():
    # Robot 2 is walled in at its start, the others are not.
    angles = 0.4 * math.pi + math.radians(180) + np.linspace(-1.9, 1.9, 30)
    walls = np.column_stack([0.0 + 0.2 * np.cos(angles), 1.0 + 0.2 * np.sin(angles), np.full(30, 0.02)])
    walls[:, 0] += math.cos(0.4 * math.pi)
    walls[:, 1] += math.sin(0.4 * math.pi) - 1.0
    of = runs.problem(rules.Rules(max_steps=12_000), [maps.DiskMap("cell", walls)], [(0, 1, 2, 3, 4)])
    kind = find("planned")
    outcome = runs.play(of, kind.create(of, kind.params))
    assert outcome.status.tolist() == [runs.TIMED_OUT]
    assert outcome.length[0, 2] == 0.0
    assert (outcome.arrival[0, [0, 1, 3, 4]] > 0).all()


def terrain(discs=NO_DISCS, n=5):
    return _paths.terrain(discs, 0.05, rules.starts(n), rules.goal_places(n), 1e-4, 0.1002, 0.004)


def test_a_way_past_a_point_meets_it_and_no_disc():
    disc = maps.REPORT_MAPS["c0"].obstacles
    on, room = terrain(disc), np.empty((_paths.VERTICES, 2))
    count = _paths.through(on.open, 0, 5, 0.1, 0.5, on.spacing, room)
    way = room[:count]
    assert way[0] == pytest.approx([1.0, 0.0], abs=1e-9) and way[-1] == pytest.approx([-0.999, 0.0], abs=1e-9)
    assert np.hypot(way[:, 0] - 0.1, way[:, 1] - 0.5).min() == 0.0
    assert _paths.passes(way, disc, 0.05)
    assert not _paths.passes(way, np.array([[0.1, 0.5, 0.01]]), 0.05)
    # Nothing is in the way on the far side of the point: two straight lines would do but for the discs before it.
    assert _paths.way_length(way) >= math.hypot(0.9, 0.5) + math.hypot(1.099, 0.5) - 1e-9


def test_the_first_candidate_is_the_shortest_way():
    of = runs.problem(rules.Rules(), [maps.REPORT_MAPS["minima"]], [(0, 1, 2, 3, 4)])
    exact = bounds.shortest_lengths(of)[0]
    on = terrain(maps.REPORT_MAPS["minima"].obstacles)
    for robot in range(5):
        found = [_paths.way_length(way) for way in _paths.candidates(on, robot, robot)]
        assert found == sorted(found) and len(found) > 10
        assert exact[robot] - 1e-4 <= found[0] <= exact[robot] + 2e-3


def crossing(apart, *ways):
    """Return a case of robots on polylines, one place each 0.1."""
    place, used = np.zeros((len(ways), 1, 50, 2)), np.zeros((len(ways), 1), dtype=np.int64)
    for i, way in enumerate(ways):
        way = np.array(way, dtype=np.float64)
        used[i, 0] = _paths.places(way, 0.1, 0.1, _paths.way_length(way) - 1e-9, place[i, 0])
    return _schedule.Case(place, used, apart, 0.1, int(used.max()) - 1)


def test_the_second_at_a_crossing_waits_as_long_as_it_has_to():
    # Two lines of length 2 cross at right angles at half way, robots 0.25 wide. When both go on and the second is
    # d ticks of 0.1 behind, they come as near as 0.1 d / sqrt 2: 3 ticks give 0.212, 4 give 0.283.
    case = crossing(0.25, [(-1, 0), (1, 0)], [(0, -1), (0, 1)])
    assert case.used.tolist() == [[21], [21]]
    plan, work = _schedule.room_for(case, 200)
    _schedule.search(case, plan, work, np.array([0, 1]), 0, 0)
    assert plan.arrival[0] == 20
    # It may also wait on the way: just before the crossing, 0.25 off the other's line, and then go on.
    assert plan.arrival[1] == 24
    gaps = [np.hypot(*(plan.track[0, min(t, 20)] - plan.track[1, t])) for t in range(25)]
    assert min(gaps) > 0.25


def test_who_stands_in_the_way_for_ever_is_waited_for_in_vain():
    case = crossing(0.25, [(-1, 0), (0, 0)], [(0, -1), (0, 1)])
    plan, work = _schedule.room_for(case, 200)
    _schedule.search(case, plan, work, np.array([0, 1]), 0, 0)
    assert plan.arrival.tolist() == [10, _schedule.NEVER]
    # The other order works: the first to come goes on, the one that stays there comes after it.
    _schedule.search(case, plan, work, np.array([1, 0]), 0, 0)
    assert plan.arrival[1] == 20 and plan.arrival[0] < 20
    # And the search finds that by itself.
    _schedule.search(case, plan, work, np.array([0, 1]), 50, 0)
    assert plan.arrival.max() == 20


def bands(points, discs=NO_DISCS):
    points = np.array(points, dtype=np.float64)
    return _elastic.Bands(points, points[:, -1].copy(), discs, 0.005, 0.05, 0.1, 0.0, 1e-4)


def test_a_band_becomes_straight():
    times = np.linspace(-0.8, 0.8, 21)
    bent = np.column_stack([times, 0.3 * np.cos(times / 0.8 * math.pi / 2)])
    best, length = _elastic.relax(bands([bent]), 1.595, 2000)
    assert _elastic.total_length(bent[None]) > 1.7
    assert length == pytest.approx(1.595, rel=0.01)
    assert np.abs(best[0, :, 1]).max() < 0.1


def test_bands_stay_off_discs_and_each_other():
    times = np.linspace(-0.8, 0.8, 33)
    over = np.column_stack([times, np.full(33, 0.3)])
    back = np.column_stack([-times, np.full(33, 0.15)])
    disc = np.array([[0.0, 0.0, 0.2]])
    start = bands([over, back], disc)
    # The second begins inside of where it may be and is pushed out, the first makes room.
    best, length = _elastic.relax(start, 1.6, 1000)
    assert length < 1.75
    checked = start._replace(point=best)
    assert _elastic.is_free(checked)
    assert not _elastic.is_free(checked._replace(point=np.stack([best[0], best[0][::-1]])))


def test_the_length_of_a_plan_is_set_by_the_slower_at_each_time():
    points = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 5], [0, 7], [0, 7]]], dtype=np.float64)
    assert _elastic.total_length(points) == 3.0

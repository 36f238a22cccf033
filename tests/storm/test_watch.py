"""What is checked between ticks, and what an adversary throws."""

from __future__ import annotations

import numpy as np
import pytest

from helpers import place_scenario
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_setting
from swarmscope.sim.loop import run
from swarmscope.storm.draw import Case
from swarmscope.storm.forger import KINDS, Attack, Forger
from swarmscope.storm.play import play_case
from swarmscope.storm.watch import Watch

STARTS, GOALS = [(-3.0, 0.0, 0.0), (3.0, 0.2, 3.0)], [(3.0, 0.0), (-3.0, 0.2)]
CROSSING = place_scenario(STARTS, GOALS, [{"type": "circle", "center": [0.0, 0.0], "radius": 0.5}], limit_s=60.0)


def setting_of(**more):
    scenario = parse_scenario(CROSSING | more, "test")
    return make_setting(scenario, make_setup(scenario))


def spoiled(tick, **fields):
    """Run with a hook that writes into robots (or ``decisions``) at a tick, before the watch looks."""
    setting = setting_of()
    watch = Watch(setting)

    def between(held, now):
        if now == tick:
            for name, value in fields.items():
                rows = held.what.decisions if name in ("v", "w") else held.what.robots
                rows["v" if name == "speed" else name][1] = value
        return watch(held, now)

    trace = run(setting, between=between)
    watch.finish(trace)
    return watch.breach, trace


@pytest.mark.parametrize(
    ("kind", "fields"),
    [
        ("contact", {"crashed": 1}),
        ("command", {"v": np.nan}),
        ("command", {"v": 0.6}),
        ("command", {"w": -2.1}),
        ("command", {"v": -0.1}),
        ("clearance", {"clearance": -0.001}),
        ("clearance", {"speed": 0.6}),
        ("clearance", {"x": np.inf}),
        ("radio", {"air_bytes": 10**7}),
    ],
)
def test_every_breach_is_found_in_its_tick_and_ends_the_run(kind, fields):
    breach, trace = spoiled(5, **fields)
    assert (breach.kind, breach.tick, breach.robot) == (kind, 5, 1)
    assert len(trace.t_s) == 6


def test_a_calm_run_has_no_breach_and_counts_robots_under_way_only():
    setting = setting_of()
    watch = Watch(setting)
    trace = run(setting, between=watch)
    watch.finish(trace)
    assert watch.breach is None
    assert trace.robots["arrived"].all()
    assert 0.9 * trace.robots["arrival_s"].sum() < watch.under_way_s <= trace.robots["arrival_s"].sum()
    assert watch.driving_s <= watch.under_way_s


def test_a_run_in_which_nobody_drives_any_more_ends(monkeypatch):
    from swarmscope.storm import watch as module

    monkeypatch.setattr(module, "STOOD_S", 2.0)
    setting = setting_of()
    watch = Watch(setting)

    def between(held, tick):
        held.what.decisions["v"] = 0.0
        return watch(held, tick)

    trace = run(setting, between=between)
    assert len(trace.t_s) == 11
    assert watch.under_way_s == 0.0


def test_watching_changes_nothing():
    watched, alone = run(setting_of(), between=Watch(setting_of())), run(setting_of())
    assert watched.robots.tobytes() == alone.robots.tobytes()
    np.testing.assert_array_equal(watched.records.x, alone.records.x)


@pytest.mark.parametrize("kind", KINDS)
def test_an_adversary_throws_packets_and_nobody_touches_anything(kind):
    case = Case(CROSSING, Forger(4, 6.0, (kind,)))
    first, again = play_case(case), play_case(case, threads=2)
    assert first.breach is None
    assert first.thrown > 100
    assert (first.digest, first.thrown) == (again.digest, again.thrown)


def test_its_packets_are_read():
    setting = setting_of()
    attack = Attack(Forger(1, 10.0, ("rubbish", "forged", "answers")))
    trace = run(setting, between=lambda held, tick: attack.strike(held, tick) is not None)
    assert trace.shared["dropped_bad"].sum() > 20
    assert trace.robots["sent_features"].sum() > run(setting).robots["sent_features"].sum()  # it is answered

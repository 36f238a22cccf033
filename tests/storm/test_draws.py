"""What a storm draws: the same for the same seed, all of the ranges, and only possible runs."""

from __future__ import annotations

from collections import Counter
from functools import cache

import numpy as np
import pytest

from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.scenario import NoiseModel, Scenario
from swarmscope.storm import ranges
from swarmscope.storm.draw import draw
from swarmscope.storm.worlds import KINDS, make_world, number
from swarmscope.tasks import task_names

PLANNERS = ("nav-scope", "sfm-mas", "dh-bug")
SPANS = {**ranges.SHEET, **ranges.NOISE, **ranges.RADIO, **ranges.FAULTS}


@cache
def drawn():
    return [draw(3, k, PLANNERS) for k in range(150)]


def test_the_same_seed_and_number_are_the_same_run():
    assert drawn()[7] == draw(3, 7, PLANNERS)
    assert draw(4, 7, PLANNERS).case.values != drawn()[7].case.values != drawn()[8].case.values


def test_every_run_is_a_scenario_within_the_ranges():
    for run in drawn():
        scenario = parse_scenario(run.case.values, "test")
        assert ranges.ROBOTS.low <= scenario.robots <= ranges.ROBOTS.high
        for key, span in SPANS.items():
            group, _, name = key.partition(".")
            if name in run.case.values.get(group, {}):
                assert span.low <= run.case.values[group][name] <= span.high, key
        assert scenario.noise.blind_deg == scenario.noise.scan_age_s == 0.0


@pytest.mark.parametrize("key", SPANS)
def test_both_ends_of_every_range_are_drawn(key):
    group, _, name = key.partition(".")
    span = SPANS[key]
    found = np.array([run.case.values[group][name] for run in drawn() if name in run.case.values.get(group, {})])
    assert len(found) >= 15
    places = np.log(found / span.low) / np.log(span.high / span.low) if span.log else found / span.high
    if span.inverse:
        places = (1.0 / span.low - 1.0 / found) / (1.0 / span.low - 1.0 / span.high)
    assert places.min() < 0.3 and places.max() > 0.7


def test_all_places_planners_adversaries_and_calms_are_drawn():
    runs = drawn()
    assert set(Counter(run.where for run in runs)) == {"task", "office", *KINDS}
    assert {run.case.values["planner"]["name"] for run in runs} == set(PLANNERS)
    for part in ("noise", "radio", "faults", "guard"):
        assert 10 < sum(part in run.case.values for run in runs) < 140
    assert 60 < sum(run.case.forger is not None for run in runs) < 140
    assert 2 < sum(run.again for run in runs) < 40
    views = [run.case.values["lidar"]["fov_deg"] for run in runs]
    assert min(views) < 100.0 and 60 < views.count(360.0) < 120


def test_what_is_drawn_exists():
    assert set(ranges.TASK_OPTIONS) | set(ranges.CHOICES) <= set(task_names())
    schema = Scenario.model_json_schema()["$defs"]
    for key in (*SPANS, *ranges.OPEN):
        group, _, name = key.partition(".")
        assert name in schema[f"{group.capitalize()}Model"]["properties"]
    left_out = set(NoiseModel.model_fields) - {key.partition(".")[2] for key in ranges.NOISE}
    assert left_out == {"blind_deg", "scan_age_s"}


def test_what_is_refused_is_counted_by_its_key(monkeypatch):
    narrow = ranges.Span(60, 70)
    monkeypatch.setitem(ranges.SHEET, "lidar.beams", narrow)
    monkeypatch.setitem(ranges.SHEET, "robot.radius_m", ranges.Span(0.4, 0.5))
    refused = [draw(1, k, PLANNERS) for k in range(6)]
    assert all(isinstance(run, dict) or run.refused for run in refused) or any(run.refused for run in refused)
    counts = Counter(key for run in refused for key in (run if isinstance(run, dict) else run.refused))
    assert counts["lidar.beams"] > 0


def test_only_what_is_covered_can_be_drawn():
    for k in range(30):
        run = draw(3, k, PLANNERS, covered=True)
        scenario = parse_scenario(run.case.values, "test")
        default = Scenario.model_validate({"task": {"name": "T1"}})
        for key, span in ranges.OPEN.items():
            group, _, name = key.partition(".")
            value = getattr(getattr(scenario, group), name)
            usual = getattr(getattr(default, group), name)
            assert value == usual if span is None else span.low <= value <= span.high


@pytest.mark.parametrize("kind", KINDS)
def test_worlds_of_every_kind_are_worlds(kind):
    from swarmscope.sim.world import WorldSpec, compile_world

    rng = np.random.default_rng(0)
    sizes = set()
    for _ in range(20):
        spec = WorldSpec.model_validate(make_world(rng, kind, 0.2))
        compile_world(spec)
        sizes.add(len(spec.obstacles))
    assert len(sizes) > 2


def test_numbers_stay_in_their_span():
    rng = np.random.default_rng(0)
    for span, middle in (
        (ranges.Span(0.1, 10.0, True), 1.0),
        (ranges.Span(0.0, 1.0), 0.5),
        (ranges.Span(1.0, 20.0, inverse=True), 1.0 / 0.525),
    ):
        found = [number(rng, span) for _ in range(5000)]
        assert span.low <= min(found) < max(found) <= span.high
        assert np.median(found) == pytest.approx(middle, rel=0.1)

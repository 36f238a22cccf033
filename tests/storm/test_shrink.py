"""Breaches made small, on a rule of our own and on a planner that is blind."""

from __future__ import annotations

import json
import time

import pytest
from wild_planners import write_blind

from helpers import place_scenario
from swarmscope.errors import ConfigError
from swarmscope.storm.breach_file import as_text, read_case
from swarmscope.storm.draw import Case, Draw
from swarmscope.storm.forger import Forger
from swarmscope.storm.play import Storm, draw_job, make_job, play_job, watched
from swarmscope.storm.shrink import breach_of, shrink
from swarmscope.storm.watch import Breach

ROBOTS = 9


def big():
    starts = [(1.0 + k, 0.123 * k, 0.0) for k in range(ROBOTS)]
    circles = [{"type": "circle", "center": [0.5 + k, 5.0], "radius": 0.25} for k in range(7)]
    more = {
        "noise": {"nan": 0.123, "compass_deg": 3.21}, "radio": {"loss": 0.5}, "robot": {"v_max_mps": 1.2345},
        "lidar": {"rate_hz": 5.0}, "limit_s": 100.0,
    }  # fmt: skip
    return Case(place_scenario(starts, starts_to_goals(starts), circles, **more), Forger(1, 3.0))


def starts_to_goals(starts):
    return [(x, y + 2.0) for x, y, _ in starts]


def fails_by(rule):
    def play(case):
        play.runs += 1
        return Breach("contact", 12, 0, "") if rule(case.values, case.forger) else None

    play.runs = 0
    return play


def test_only_what_the_breach_needs_is_left():
    def rule(values, forger):
        near = [s for s in values["place"]["starts"] if s[0] in (3.0, 6.0)]
        radii = {o["center"][0] for o in values["place"]["world"]["obstacles"]}
        return len(near) == 2 and 2.5 in radii and values.get("noise", {}).get("nan", 0.0) > 0.1

    play = fails_by(rule)
    small, breach = shrink(big(), "contact", 400, play)
    assert breach.tick == 12
    assert [s[0] for s in small.values["place"]["starts"]] == [3.0, 6.0] and small.values["robots"] == 2
    assert [o["center"][0] for o in small.values["place"]["world"]["obstacles"]] == [2.5]
    assert small.values["noise"] == {"nan": 0.12}
    assert "radio" not in small.values and small.values["robot"] == {}
    assert small.values["limit_s"] == 2.6
    assert small.forger is None
    assert play.runs <= 400


def test_an_adversary_that_is_needed_is_kept_as_plain_as_can_be():
    small, _ = shrink(big(), "contact", 400, fails_by(lambda v, f: f is not None and "forged" in f.kinds))
    assert small.forger.kinds == ("forged",) and small.forger.per_tick < 0.1
    assert small.values["robots"] == 1


def test_it_is_the_same_every_time_and_keeps_to_its_number_of_runs():
    def rule(values, forger):
        return values["robots"] > 3

    plays = [fails_by(rule) for _ in range(2)]
    first, again = (shrink(big(), "contact", 15, play)[0] for play in plays)
    assert json.dumps(first.values) == json.dumps(again.values)
    assert [play.runs for play in plays] == [15, 15]


def test_another_kind_of_breach_is_another_matter():
    assert shrink(big(), "radio", 50, fails_by(lambda v, f: True)) == (big(), None)


def test_a_breach_is_read_back_from_its_file(tmp_path):
    for case in (big(), Case(big().values)):
        file = tmp_path / "breach.yaml"
        file.write_text(as_text(case, Breach("contact", 3, 0, "robot 0 touched the world"), "1:2"))
        again = read_case(file)
        assert again.forger == case.forger
        assert again.values == json.loads(json.dumps(case.values))
        assert "robot 0 touched the world" in file.read_text()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[1]", "a mapping"),
        ("scenario: {task: {name: T1}}\nmore: 1", "more"),
        ("adversary: {seed: 1}\nscenario: {task: {name: T1}}", "adversary: needs the keys"),
        ("adversary: {seed: 1, per_tick: x, kinds: [forged]}\nscenario: {task: {name: T1}}", "per_tick"),
        ("adversary: {seed: 1, per_tick: 1, kinds: [lies]}\nscenario: {task: {name: T1}}", "kinds"),
        ("adversary: {seed: -1, per_tick: 1, kinds: [forged]}\nscenario: {task: {name: T1}}", "seed"),
        ("adversary: {seed: 1, per_tick: 1, kinds: [forged]}", "exactly one of"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(text, said, tmp_path):
    file = tmp_path / "breach.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=said):
        read_case(file)


def test_a_planner_that_puts_out_its_eyes_is_found_and_made_small(tmp_path):
    storm = Storm(0, [str(write_blind(tmp_path))])
    begun = time.monotonic()
    for index in range(20):
        job = make_job(storm, index)
        breach = json.loads(play_job(job)).get("breach")
        if breach is not None:
            break
    assert breach["kind"] == "contact"
    assert time.monotonic() - begun < 120.0  # a minute, and one for the compiler
    drawn = draw_job(json.loads(job))
    assert isinstance(drawn, Draw)
    small, found = shrink(drawn.case, "contact", 200)
    assert small.values["robots"] <= 2
    assert len(small.values["place"]["world"]["obstacles"]) <= 2
    assert small.forger is None
    assert found == breach_of(small) == watched(small).breach

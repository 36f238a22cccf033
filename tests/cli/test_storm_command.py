"""``swarmscope storm`` as people type it."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from command_line import refused, swarmscope

from swarmscope.judging.run_folder import read_metrics

sys.path.insert(0, str(Path(__file__).parents[1] / "storm"))
from wild_planners import write_blind

ONE = ["--planner", "nav-scope", "--workers", "1", "--covered"]


def numbers_in(file):
    return [run["number"] for piece in json.loads(file.read_text())["pieces"] for run in piece["runs"]]


def test_a_small_storm_adds_up_and_goes_on_where_it_was(tmp_path):
    file = tmp_path / "storms.json"
    first = swarmscope("storm", "--runs", 3, "--seed", 5, *ONE, "--into", file)
    assert first.exit_code == 0, first.stdout + first.stderr
    assert "below" in first.stdout and "robot-hours under way" in first.stdout
    assert numbers_in(file) == [0, 1, 2]
    before = json.loads(file.read_text())["pieces"][0]["runs"]
    assert swarmscope("storm", "--runs", 2, "--seed", 5, *ONE, "--into", file).exit_code == 0
    assert numbers_in(file) == [0, 1, 2, 3, 4]
    assert json.loads(file.read_text())["pieces"][0]["runs"][:3] == before
    assert swarmscope("storm", "--runs", 1, "--seed", 6, *ONE, "--into", file).exit_code == 0
    assert sorted(numbers_in(file)) == [0, 0, 1, 2, 3, 4]


def test_two_workers_find_what_one_finds(tmp_path):
    files = [tmp_path / f"{workers}.json" for workers in (1, 2)]
    for file, workers in zip(files, (1, 2), strict=True):
        words = ["--planner", "nav-scope", "--covered", "--workers", workers, "--into", file]
        assert swarmscope("storm", "--runs", 4, "--seed", 7, *words).exit_code == 0
    found = []
    for file in files:
        runs = json.loads(file.read_text())["pieces"][0]["runs"]
        found.append([{name: value for name, value in run.items() if name != "wall_s"} for run in runs])
    assert found[0] == found[1]


def test_no_minutes_are_no_runs():
    said = swarmscope("storm", "--minutes", 0, *ONE)
    assert said.exit_code == 0 and "nothing drove" in said.stdout


def test_a_breach_is_written_and_seen_again(tmp_path):
    planner = write_blind(tmp_path)
    said = swarmscope("storm", "--runs", 4, "--planner", planner, "--workers", 1, "--out", tmp_path / "found")
    assert said.exit_code == 1
    assert "touched" in said.stdout
    files = sorted((tmp_path / "found").glob("breach-0-*.yaml"))
    assert files
    again = swarmscope("storm", "--replay", files[0])
    assert again.exit_code == 1 and "contact" in again.stdout
    drawn = swarmscope("storm", "--replay", f"0:{files[0].stem.rpartition('-')[2]}", "--planner", planner,
                       "--out", tmp_path / "again")  # fmt: skip
    assert drawn.exit_code == 1
    assert (tmp_path / "again" / files[0].name).read_text() == files[0].read_text()
    if "adversary" not in files[0].read_text():
        assert swarmscope("run", files[0], "--out", tmp_path / "run", "--no-pictures").exit_code == 0
        assert read_metrics(tmp_path / "run")["collisions"] > 0


def test_a_run_without_a_breach_can_be_seen_too():
    said = swarmscope("storm", "--replay", "5:0", "--planner", "nav-scope", "--covered")
    assert said.exit_code == 0 and "no breach" in said.stdout


WRONG = {
    "planner": (["--planner", "nav-scop"], "did you mean 'nav-scope'"),
    "file": (["--replay", "nowhere.yaml"], "nowhere.yaml"),
    "code": (["--planner", "blind.py", "--no-code"], "user's file"),
    "torn": (["--into", "torn.json"], "torn.json: is torn, or not a storm's file; nothing was changed"),
    "folder": (["--into", "."], "is a folder"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_said_in_one_line(case, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_blind(tmp_path)
    (tmp_path / "torn.json").write_text('{"storms": 1, "pieces": [')
    words, said = WRONG[case]
    assert said in refused("storm", "--runs", 1, *words)
    assert (tmp_path / "torn.json").read_text() == '{"storms": 1, "pieces": ['

"""``swarmscope barn`` as people type it, on small worlds of our own and on the challenge's where it lies."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from command_line import refused, swarmscope

from swarmscope.cli import barn as barn_module
from swarmscope.judging.run_folder import read_metrics

sys.path.insert(0, str(Path(__file__).parents[1] / "barn"))
from barn_files import clutter, path_m, shut, write_folder, write_npz

OURS = {1: clutter(1), 4: clutter(2), 9: shut()}
BARN = "shared/data/barn/barn_static_even.npz"
"""Beside the clone; it does not come with it."""


def play(*words):
    """Run the command in this process; return what it printed and what it wrote."""
    result = swarmscope("barn", *words)
    assert result.exit_code == 0, result.stderr
    return result.stdout


def written(file):
    values = json.loads(file.read_text())
    del values["about"]
    return values


@pytest.fixture
def npz(tmp_path):
    return write_npz(tmp_path / "barn.npz", OURS)


def test_both_kinds_of_files_and_any_number_of_workers_give_the_same(npz, tmp_path):
    folder = write_folder(tmp_path / "BARN", OURS)
    said = play(npz, "--workers", 1, "--speed", 1, "--out", tmp_path / "a.json")
    assert "2 of 3" in said and "nav-scope, 1 m/s, world 9: robot 0: no way from its start to its goal" in said
    again = play(folder, "--workers", 2, "--speed", 1, "--out", tmp_path / "b.json")
    assert said.splitlines()[1:-1] == again.splitlines()[1:-1]  # but for names of files
    assert written(tmp_path / "a.json") == written(tmp_path / "b.json")
    (row,) = written(tmp_path / "a.json")["rows"]
    assert (row["worlds"], row["arrived"], row["collisions"]) == (3, 2, 0)
    for run in written(tmp_path / "a.json")["runs"][:2]:
        assert run["arrived"] and run["why"] == "" and run["path_m"] == pytest.approx(path_m())
        assert run["score"] == pytest.approx(0.5 * path_m() / min(max(run["time_s"], path_m()), 4.0 * path_m()))
        assert run["clearance_m"] > 0.0 and 9.0 < run["time_s"] < 30.0


def test_planners_are_compared_in_the_same_worlds(npz, tmp_path):
    said = play(npz, "--planner", "nav-scope", "--planner", "dh-bug", "--worlds", "1,4", "--workers", 1)
    assert "2 m/s, same worlds: score of nav-scope less dh-bug " in said
    assert "only nav-scope arrives in 0, only dh-bug in 0" in said


def test_the_table_stands_upright_in_a_narrow_terminal(npz, capsys):
    worlds = barn_module.find_worlds(npz)
    choices = barn_module.choices_of(["nav-scope"], [1.0])
    rows = barn_module.rows_of(barn_module.play_all(worlds, [1], choices, workers=1), choices)
    for width, lines in ((150, 1), (80, 9)):
        barn_module.print_rows(rows, "BARN", width)
        said = capsys.readouterr().out
        assert "…" not in said and "time, median" in said and said.count("│\n") == lines


def test_without_a_path_file_the_shortest_way_counts(tmp_path):
    folder = write_folder(tmp_path / "BARN", OURS, paths=False)
    said = play(folder, "--workers", 1, "--out", tmp_path / "a.json")
    assert "3 worlds come without a path file" in said
    first, _, shut_in = written(tmp_path / "a.json")["runs"]
    assert 10.0 < first["path_m"] < path_m() and not first["own_path"]
    assert shut_in["path_m"] is None and shut_in["score"] == 0.0


def test_late_robots_are_named_with_the_reason(npz):
    said = play(npz, "--worlds", "4", "--set", "limit_s=3", "--workers", 1)
    assert "0 of 1" in said and "nav-scope, 2 m/s, world 4: time limit in state" in said
    assert "nan" not in said


def test_of_many_failures_only_the_first_are_printed(npz, monkeypatch):
    monkeypatch.setattr(barn_module, "SHOWN_FAILURES", 1)
    said = play(npz, "--worlds", "1,4", "--set", "limit_s=1", "--workers", 1)
    assert said.count("time limit in state") == 1 and "... and 1 more" in said


def test_runs_are_kept_with_picture_and_page(npz, tmp_path):
    words = ("--worlds", 1, "--workers", 1, "--speed", 1, "--speed", 2)
    done = swarmscope("barn", npz, *words, "--runs", tmp_path / "kept")
    assert done.exit_code == 0, done.stderr
    folders = [tmp_path / "kept" / f"world-1-nav-scope-{speed}" for speed in (1, 2)]
    assert done.stdout.splitlines()[-2:] == [str(folder / "replay.html") for folder in folders]
    for folder in folders:
        assert (folder / "paths.png").exists() and read_metrics(folder)["run"]["robots"] == 1
    (tmp_path / "kept/world-1").write_text("precious")
    assert "world-1: is a file" in refused("barn", npz, "--worlds", 1, "--runs", tmp_path / "kept")


def test_a_worlds_scenario_can_be_written_and_run(npz, tmp_path):
    file = tmp_path / "w4.yaml"
    said = play(npz, "--write-scenario", 4, file, "--speed", 1.5, "--set", "safety.margin_m=0.05")
    assert f"swarmscope run {file}" in said
    values = yaml.safe_load(file.read_text())
    assert len(values["place"]["world"]["obstacles"]) == len(OURS[4])
    assert (values["robot"]["v_max_mps"], values["safety"]["margin_m"], values["guard"]["others_mps"]) == (
        1.5,
        0.05,
        0.0,
    )
    assert swarmscope("run", file, "--out", tmp_path / "r").exit_code == 0
    assert (tmp_path / "r/paths.png").exists()
    assert read_metrics(tmp_path / "r")["arrival_rate"] == 1.0


WRONG = {
    "no file": (["nowhere.npz"], ["nowhere.npz", "No such file"]),
    "world": (["--worlds", "1,2"], ["--worlds", "there is no world 2"]),
    "worlds": (["--worlds", "x"], ["--worlds x: must look like 0,4,10-19"]),
    "planner": (["--planner", "nav-scop"], ["world 1: planner.name", "did you mean 'nav-scope'"]),
    "planner twice": (["--planner", "nav-i", "--planner", "nav-i"], ["--planner", "'nav-i' is there twice"]),
    "speed twice": (["--speed", "1", "--speed", "1.0"], ["--speed", "'1' is there twice"]),
    "speed": (["--speed", "0"], ["robot.v_max_mps", "greater than or equal to 0.001"]),
    "key": (["--set", "radio.los=1"], ["radio.los", "unknown key", "did you mean 'loss'"]),
    "parameter": (["--set", "planner.params.w_ii=1"], ["parameter 'w_ii'", "did you mean 'w_i'"]),
    "their key": (["--set", "robot.v_max_mps=1"], ["--set robot.v_max_mps=1", "--speed"]),
    "blind": (["--set", "lidar.range_m=0.2"], ["lidar.range_m", "too short"]),
    "two to write": (
        ["--write-scenario", "1", "x.yaml", "--speed", "1", "--speed", "2"],
        ["one planner and one speed"],
    ),
    "none to write": (["--write-scenario", "2", "x.yaml"], ["there is no world 2"]),
    "code": (["--planner", "mine.py", "--no-code"], ["mine.py"]),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_said_in_one_line(case, npz, monkeypatch):
    monkeypatch.chdir(npz.parent)
    words, parts = WRONG[case]
    said = refused(
        "barn", *([] if case == "no file" else [npz]), *words, *([] if "write" in case else ["--workers", 1])
    )
    for part in parts:
        assert part in said
    assert {file.name for file in npz.parent.iterdir()} == {"barn.npz"}


def test_a_torn_world_file_is_named(tmp_path):
    folder = write_folder(tmp_path / "BARN", {1: clutter(1), 4: clutter(2)})
    file = folder / "world_files/world_4.world"
    file.write_text(file.read_text()[:-30])
    assert f"{file}: torn, or no XML" in refused("barn", folder, "--workers", 1)


def test_a_place_that_cannot_be_written_is_told_before_the_work(npz, monkeypatch):
    monkeypatch.setattr(barn_module, "play_all", lambda *_: pytest.fail("played"))
    assert "is a folder" in refused("barn", npz, "--out", npz.parent)
    assert "cannot write" in refused("barn", npz, "--out", npz / "a.json")


def test_robots_arrive_in_worlds_of_the_challenge(tmp_path):
    found = [folder / BARN for folder in Path(__file__).parents if (folder / BARN).exists()]
    if not found:
        pytest.skip(f"the challenge's worlds are not at {BARN} beside the clone")
    play(found[0], "--worlds", "0,100,200", "--speed", 1, "--speed", 2, "--workers", 1, "--out", tmp_path / "a.json")
    slow, fast = written(tmp_path / "a.json")["rows"]
    assert (slow["arrived"], fast["arrived"], slow["collisions"], fast["collisions"]) == (3, 3, 0, 0)
    paths = [run["path_m"] for run in written(tmp_path / "a.json")["runs"]]
    assert min(paths) > 10.0 and np.ptp(paths) > 0.0

"""``swarmscope disk``: what people type, what comes out, and what is told when it is wrong."""

import csv
import json
import shlex

import pytest
from command_line import refused, swarmscope


def test_a_run_by_two_controllers_leaves_pictures_and_a_page(tmp_path):
    out = tmp_path / "run"
    words = ("disk", "run", "report", "reactive", "--map", "one-disc", "--permutation", "0,3,1,4,2", "--out", out)
    result = swarmscope(*words)
    assert result.exit_code == 0
    assert result.stdout.count("all arrived after") == 2
    names = {path.name for path in out.iterdir()}
    assert {"report.png", "report-clearance.png", "reactive.png", "replay.html", "report.html", "runs.csv"} < names
    about = json.loads((out / "result.json").read_text())
    assert about["command"].startswith("swarmscope disk run report reactive") and "git" in about
    first = (out / "runs.csv").read_bytes()
    swarmscope(*words)
    assert (out / "runs.csv").read_bytes() == first


def test_the_table_shows_printed_figures_and_the_bound(tmp_path):
    result = swarmscope("disk", "table", "report", "--map", "one-disc", "--workers", 1, "--out", tmp_path / "t")
    assert result.exit_code == 0
    for words in ("printed in the report", "8,450.4", "14906", "7,820.7", "120/120"):
        assert words in result.stdout
    rows = list(csv.DictReader((tmp_path / "t/runs.csv").open()))
    assert len(rows) == 120 and {row["ended"] for row in rows} == {"arrived"}
    assert "8,450.42" in (tmp_path / "t/report.html").read_text()


def test_failed_runs_are_named(tmp_path):
    words = ("--map", "minima", "--permutation", "01243", "--workers", 1, "--out", tmp_path / "t")
    result = swarmscope("disk", "table", "report", "reactive", *words)
    assert "report: minima, permutation 0,1,2,4,3: ran out of steps; not at their goals: 2" in result.stdout


def test_random_maps(tmp_path):
    words = ("--robots", 5, "--robots", 8, "--seeds", "disk-tuning", "--maps", 3, "--workers", 1, "--out", tmp_path)
    result = swarmscope("disk", "random", "reactive", *words)
    assert result.exit_code == 0
    assert result.stdout.count("reactive: 100.00% arrive") == 2
    assert len(list(csv.DictReader((tmp_path / "runs.csv").open()))) == 6


def test_a_field(tmp_path):
    words = ("--map", "one-disc", "--alone", "--resolution", 21, "--out", tmp_path / "f.png")
    result = swarmscope("disk", "field", "navigation-function", *words)
    assert "; 0 stall points" in result.stdout
    assert (tmp_path / "f.png").read_bytes().startswith(b"\x89PNG")


def test_the_repulsion(tmp_path):
    assert swarmscope("disk", "repulsion", "--out", tmp_path / "r.png").exit_code == 0
    assert (tmp_path / "r.png").read_bytes().startswith(b"\x89PNG")
    assert "is a folder" in refused("disk", "repulsion", "--out", tmp_path)


def test_the_students_path(tmp_path):
    mine = tmp_path / "mine.py"
    assert "swarmscope disk run" in swarmscope("disk", "start", mine).stdout
    assert "is there already" in refused("disk", "start", mine)
    result = swarmscope("disk", "run", mine, "--map", "one-disc", "--out", tmp_path / "run")
    assert result.exit_code == 0 and result.stdout.startswith("mine: ")
    words = ("--map", "one-disc", "--permutation", "43210", "--permutation", "01234", "--out", tmp_path / "t")
    result = swarmscope("disk", "table", mine, "reactive", *words)
    assert result.exit_code == 0 and "mine" in result.stdout and "reactive" in result.stdout


def test_the_list_says_what_each_knows_and_guarantees():
    result = swarmscope("disk", "list")
    for words in (
        "report",
        "navigation-function",
        "reactive",
        "planned",
        "knows:",
        "guarantees:",
        "crevice",
        "random:SEED",
    ):
        assert words in result.stdout


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("run", "reactiv"), "did you mean 'reactive'"),
        (("run", "--map", "crevise"), "did you mean 'crevice'"),
        (("run", "--permutation", "0,1,2,3,3"), "each of 0 to 4 once"),
        (("run", "--robots", "50", "--radius", "0.1"), "overlap at their starts"),
        (("run", "none.py"), "No such file"),
        (("table", "report", "report"), "name each once"),
        (("table", "report", "--map", "c0", "--map", "c0"), "two maps have this name"),
        (("run", "reactive:gain=2"), "reactive.gain: 2 is not between"),
        (("start", "mine.txt"), "ends in .py"),
        (("table", "report:obstacle_buffer"), "not KEY=VALUE"),
        (("random", "--seeds", "nothing"), "nothing"),
        (("field", "report", "--robot", "5"), "no robot 5"),
        (("field", "planned"), "has no field"),
        (("repulsion", "reactive"), "only 'report' has"),
    ],
)
def test_what_cannot_be_done_is_told(words, why, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert why in refused("disk", *words)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("height", "why"), [(0.35, "infeasible: robot 1 of"), (0.0, "robot 0 would touch obstacle")])
def test_an_impossible_map_is_refused(height, why, tmp_path):
    place = tmp_path / "wall.yaml"
    wall = "\n".join(f"  - {{center: [{x / 10 - 1}, {height}], radius: 0.06}}" for x in range(21))
    place.write_text(f"obstacles:\n{wall}\n")
    assert why in refused("disk", "run", "--map", place, "--out", tmp_path / "out")


def test_the_command_that_is_kept_makes_the_same_run_again(tmp_path):
    words = ("disk", "run", "report", "--map", "random:20007", "--radius", "0.04", "--out", tmp_path / "my run")
    assert swarmscope(*words).exit_code == 0
    kept = shlex.split(json.loads((tmp_path / "my run" / "result.json").read_text())["command"])
    assert "--radius" in kept
    assert swarmscope(*kept[1:], "--out", tmp_path / "again").exit_code == 0
    first, again = (tmp_path / name / "runs.csv" for name in ("my run", "again"))
    assert first.read_bytes() == again.read_bytes()


@pytest.mark.parametrize("words", [("run", "mine.py"), ("field", "mine.py")])
def test_a_place_that_cannot_be_written_is_told_before_any_step(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    (tmp_path / "mine.py").write_text("def compute_gradients(state, targets, obstacles, r):\n    return 1 / 0\n")
    assert "cannot write" in refused("disk", *words, "--out", tmp_path / "file" / "here")


def test_a_controller_that_fails_is_told_where(tmp_path):
    mine = tmp_path / "mine.py"
    mine.write_text("def compute_gradients(state, targets, obstacles, r):\n    return targets[:3]\n")
    told = refused("disk", "table", mine, "--map", "c0", "--permutation", "01234", "--out", tmp_path / "t")
    assert "returned an array of shape (3, 2), wanted (5, 2)" in told and "map c0" in told


def test_a_run_that_collides_does_not_end_with_0(tmp_path):
    body = "def compute_gradients(state, targets, obstacles, r): return 0 * state + [[1, 0]]\n"
    (tmp_path / "out.py").write_text(body)
    result = swarmscope("disk", "run", tmp_path / "out.py", "--out", tmp_path / "r", "--call-limit", "5")
    assert result.exit_code == 1 and "out: robot 0 left the disk in step 0" in result.stdout
    assert (tmp_path / "r" / "report.html").is_file()

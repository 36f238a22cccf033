"""``swarmscope experiment`` and ``swarmscope reproduce`` as people type them."""

import csv
import sqlite3

import pytest
import yaml
from command_line import refused, swarmscope

VALUES = {
    "name": "doors",
    "title": "Two ways to plan",
    "seeds": "1000-1001",
    "scenario": {"robots": 3, "limit_s": 20.0},
    "places": {"near": {"task": {"name": "T1", "options": {"size_m": 5.0}}}},
    "planners": {
        "alone": {"planner": {"name": "nav-scope", "params": {"w_i": 0.0}}},
        "Nav-SCOPE": {"planner": {"name": "nav-scope"}},
    },
    "ours": "Nav-SCOPE",
}


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "doors.yaml"
    path.write_text(yaml.safe_dump(VALUES))
    return path


def test_run_status_report_export(file, tmp_path):
    refused("experiment", "status", file)  # nothing yet
    first = swarmscope("experiment", "run", file, "--maps", 1, "--engine", "in-process")
    assert first.exit_code == 0, first.stderr
    assert first.stdout.strip().endswith("runs/doors/report/report.html")
    assert (tmp_path / "runs/doors/report/report.html").exists()
    status = swarmscope("experiment", "status", file).stdout
    assert "2 done, 0 failed, 2 missing; file ok" in status
    rest = swarmscope("experiment", "resume", file, "--engine", "in-process")
    assert rest.exit_code == 0
    assert "4 done, 0 failed, 0 missing" in swarmscope("experiment", "status", file).stdout
    assert swarmscope("experiment", "report", file, "--out", "elsewhere").stdout.strip() == "elsewhere/report.html"
    assert swarmscope("experiment", "export", file, "all.csv").stdout == "all.csv: 4 runs\n"
    rows = list(csv.DictReader((tmp_path / "all.csv").read_text().splitlines()))
    expected = {(planner, seed) for planner in VALUES["planners"] for seed in ("1000", "1001")}
    assert {(row["planner"], row["seed"]) for row in rows} == expected


def test_failures_are_named_and_the_rest_is_run(file):
    values = VALUES | {"places": VALUES["places"] | {"crowd": {"task": {"name": "T1", "options": {"density": 9.0}}}}}
    file.write_text(yaml.safe_dump(values))
    done = swarmscope("experiment", "run", file, "--maps", 1, "--engine", "in-process")
    assert done.exit_code == 2
    assert "failed: crowd, alone, seed 1000" in done.stderr and "trees" in done.stderr
    assert "2 done, 2 failed" in swarmscope("experiment", "status", file, "--maps", 1).stdout


def test_refusals(file):
    assert "did you mean 'nav-scope'" in refused("reproduce", "nav-scoop")
    assert "did you mean 'local'" in refused("experiment", "run", file, "--engine", "locl")
    assert "--engine ray only" in refused("experiment", "run", file, "--address", "auto")
    assert "unknown experiment" in refused("experiment", "run", "nothing")
    assert "cannot be read" in refused("experiment", "run", "nothing.yaml")
    file.write_text("name: 1\nplacs: {}")
    assert "doors.yaml" in refused("experiment", "run", file)


def test_a_damaged_store_is_left_alone(file, tmp_path):
    bad = tmp_path / "bad.sqlite"
    bad.write_text("SQLite format 3\x00" + "rubbish " * 500)
    before = bad.read_bytes()
    for word in ("run", "resume", "status", "report"):
        assert "bad.sqlite" in refused("experiment", word, file, "--store", bad)
    assert bad.read_bytes() == before


def test_the_status_of_a_store_with_damaged_rows_is_not_0(file, tmp_path):
    store = tmp_path / "runs.sqlite"
    more = ("--store", store, "--maps", 1)
    assert swarmscope("experiment", "run", file, *more, "--engine", "in-process").exit_code == 0
    with sqlite3.connect(store) as opened:
        opened.execute("UPDATE runs SET cases = 'x' WHERE key = (SELECT min(key) FROM runs)")
    opened.close()
    result = swarmscope("experiment", "status", file, *more)
    assert result.exit_code == 2
    assert "runs.sqlite: damaged row: " in result.stderr and "cases is no JSON" in result.stderr
    assert swarmscope("experiment", "resume", file, *more, "--engine", "in-process").exit_code == 0
    assert swarmscope("experiment", "status", file, *more).exit_code == 0


def test_help_has_examples():
    for words in (["experiment", "--help"], ["experiment", "run", "--help"], ["reproduce", "--help"]):
        assert swarmscope(*words).exit_code == 0
    assert "swarmscope reproduce nav-scope --maps 20" in swarmscope("reproduce", "--help").stdout


def test_a_folder_called_like_a_shipped_experiment_is_not_taken_for_its_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "depository").mkdir()
    assert "no such store" in refused("experiment", "status", "depository")

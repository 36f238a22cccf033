"""``swarmscope config``."""

from __future__ import annotations

import json

import pytest
from command_line import refused, swarmscope

from swarmscope.judging.run_folder import read_config
from swarmscope.scenarios.scenario import Scenario


def test_what_it_prints_is_a_scenario_that_runs_as_without(tmp_path):
    few = ["--robots", 2, "--limit", 3, "--no-pictures"]
    file = tmp_path / "my.yaml"
    file.write_text(swarmscope("config", "T2", "--planner", "dh-bug").stdout)
    assert swarmscope("run", file, *few, "--out", tmp_path / "a").exit_code == 0
    swarmscope("run", "--task", "T2", "--planner", "dh-bug", *few, "--out", tmp_path / "b")
    for name in ("config.yaml", "world.json", "trajectory.npz"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    assert read_config(tmp_path / "a")["task"]["name"] == "T2"


def test_every_key_has_its_meaning_behind_it():
    lines = swarmscope("config").stdout.splitlines()
    assert lines[1].startswith("task:  # ") and lines[2].startswith("  name: T1  # ")
    assert len(lines) > 50 and all("# " in line for line in lines)
    assert "  bitrate_bps: 78125.0  # Bandwidth of a robot's radio" in "\n".join(lines)


def test_the_schema_says_bounds_and_meanings():
    schema = json.loads(swarmscope("config", "--schema").stdout)
    assert set(schema["properties"]) == set(Scenario.model_fields)
    loss = schema["$defs"]["RadioModel"]["properties"]["loss"]
    assert (loss["minimum"], loss["maximum"], loss["default"]) == (0.0, 1.0, 0.0)
    assert "lost by chance" in loss["description"]
    groups = schema["$defs"].items()
    assert all("description" in field for _, group in groups for field in group["properties"].values())


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["T9"], ["task.name", "unknown task 'T9'", "valid: "]),
        (["T1", "--planner", "nav-scop"], ["planner.name", "did you mean 'nav-scope'"]),
    ],
)
def test_slips_are_told_the_nearest(words, told):
    said = refused("config", *words)
    assert all(word in said for word in told)


def test_help_has_examples():
    said = swarmscope("config", "--help").stdout
    assert "swarmscope config T1 > my.yaml" in said and "--schema" in said

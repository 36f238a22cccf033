"""``swarmscope run`` as people type it."""

from __future__ import annotations

import os
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from command_line import SMALL, refused, swarmscope

from swarmscope.cli import run as run_module
from swarmscope.experiments import warm_up
from swarmscope.judging.run_folder import RUN_FILES, read_config, read_metrics, read_world
from swarmscope.judging.run_names import usual_folder
from swarmscope.scenarios.read import parse_scenario
from swarmscope.sim.maps import save_map
from swarmscope.sim.world import grid_from_solid

ROOT = Path(__file__).parents[2]


def test_run_makes_a_complete_folder_and_prints_what_came_out(tmp_path):
    out = tmp_path / "first"
    result = swarmscope("run", "--task", "T1", "--planner", "nav-scope", "--robots", 4, "--seed", 1, "--out", out)
    assert result.exit_code == 0
    assert {entry.name for entry in out.iterdir()} == RUN_FILES
    metrics = read_metrics(out)
    assert metrics["run"] == {"task": "T1", "planner": "nav-scope", "robots": 4, "seed": 1}
    assert metrics["arrival_rate"] == 1.0 and metrics["collisions"] == 0
    for words in ("T1 · nav-scope · 4 robots · seed 1", "arrived", "100.0%", "collisions", "path redundancy"):
        assert words in result.stdout
    assert [Path(line).name for line in result.stdout.splitlines()[-2:]] == ["paths.png", "replay.html"]


def test_robots_that_do_not_arrive_are_named_and_are_no_error(tmp_path):
    result = swarmscope("run", *SMALL, "--out", tmp_path / "r")
    assert result.exit_code == 0
    assert result.stdout.count("did not arrive: time limit in state") == 3


def test_of_many_failures_only_the_first_are_printed(tmp_path):
    words = ("run", "--task", "swap", "--robots", 15, "--limit", 1, "--no-pictures", "--out", tmp_path / "r")
    result = swarmscope(*words)
    assert result.stdout.count("did not arrive") == run_module.MOST_FAILURES
    assert "and 5 more robots, all named in metrics.json" in result.stdout


def test_default_folder_is_named_after_what_is_not_the_default(tmp_path, monkeypatch):
    """Place, planner, seed; and a hash of all else, so that a run with another parameter has another folder."""
    monkeypatch.chdir(tmp_path)
    for changes in ((), ("--set", "robot.v_max_mps=0.6"), ("--set", "robot.v_max_mps=0.7")):
        assert swarmscope("run", *SMALL, "--seed", 7, *changes).exit_code == 0
    folders = sorted(Path("runs").iterdir())
    assert len(folders) == 3
    assert all(re.fullmatch(r"T1-nav-scope-7-[0-9a-f]{6}", folder.name) for folder in folders)
    speeds = [read_config(folder)["robot"]["v_max_mps"] for folder in folders]
    assert sorted(speeds) == [0.5, 0.6, 0.7]
    assert swarmscope("run", *SMALL, "--seed", 7).exit_code == 0  # the same run takes its own place
    assert len(list(Path("runs").iterdir())) == 3


def test_nothing_but_defaults_needs_no_hash():
    folder = usual_folder(parse_scenario({"task": {"name": "T2"}, "seed": 4, "planner": {"name": "dh-bug"}}, "test"))
    assert folder == Path("runs/T2-dh-bug-4")
    place = {"world": {"bounds": [0, 0, 9, 9]}, "starts": [[1, 1, 0]], "goals": [[5, 5]]}
    names = {usual_folder(parse_scenario({"place": place | {"goals": [[x, 5]]}, "robots": 1}, "test")) for x in (5, 6)}
    assert len(names) == 2


def test_another_run_is_not_written_over_unless_it_is_forced(tmp_path):
    words = ("run", *SMALL, "--no-pictures", "--out", tmp_path / "r")
    assert swarmscope(*words, "--seed", 1).exit_code == 0
    before = (tmp_path / "r/trajectory.npz").read_bytes()
    refused = swarmscope(*words, "--seed", 2)
    assert refused.exit_code == 2
    assert "holds another run ('seed' differs): give another --out, or --force" in " ".join(refused.output.split())
    assert (tmp_path / "r/trajectory.npz").read_bytes() == before
    assert swarmscope(*words, "--seed", 1).exit_code == 0
    assert swarmscope(*words, "--seed", 2, "--force").exit_code == 0
    assert read_config(tmp_path / "r")["seed"] == 2


def test_config_of_a_run_gives_the_same_run(tmp_path):
    swarmscope("run", *SMALL, "--set", "noise.range_fraction=5e-2", "--out", tmp_path / "a")
    again = swarmscope("run", tmp_path / "a/config.yaml", "--no-pictures", "--threads", 2, "--out", tmp_path / "b")
    assert again.exit_code == 0
    for name in ("config.yaml", "world.json", "trajectory.npz"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_options_go_over_the_file_and_set_over_both(tmp_path):
    file = tmp_path / "s.yaml"
    file.write_text(
        "task: {name: T1, options: {density: 0.1}}\nseed: 4\nlimit_s: 4\nrobots: 9\n"
        "planner: {name: nav-scope, params: {w_i: 0.5}}\n"
    )
    changes = ["--set", "robots=3", "--set", "radio.loss=0.25"]
    swarmscope(
        "run",
        file,
        "--task",
        "T1",
        "--planner",
        "nav-scope",
        "--robots",
        2,
        *changes,
        "--no-pictures",
        "--out",
        tmp_path / "r",
    )
    config = read_config(tmp_path / "r")
    assert config["robots"] == 3 and config["seed"] == 4 and config["radio"]["loss"] == 0.25
    assert config["task"]["options"]["density"] == 0.1  # the same task: its options stay
    assert config["planner"]["params"]["w_i"] == 0.5


def test_another_task_takes_the_place_of_the_files(tmp_path):
    file = tmp_path / "s.yaml"
    file.write_text("map: {file: willow_garage_office}\nlimit_s: 2\nrobots: 2\n")
    swarmscope("run", file, "--task", "swap", "--no-pictures", "--out", tmp_path / "r")
    config = read_config(tmp_path / "r")
    assert config["task"]["name"] == "swap" and "map" not in config


def test_parts_of_lists_are_set_by_their_numbers(tmp_path):
    """Also of two that are one in the file, by an alias of YAML."""
    places = "starts: [[-2, 0, 0], [2, 0, 3.14]]\n  goals: [[2, 1], [-2, 1]]"
    moves = "{type: circle, center: [0, 3], radius: 0.2, velocity: [0.1, 0]}"
    world = f"place:\n  world: {{bounds: [-5, -5, 5, 5], obstacles: [{moves}]}}\n  {places}\n"
    (tmp_path / "s.yaml").write_text(world + "robot: [&it {radius_m: 0.2, half_width_m: 0.2}, *it]\nlimit_s: 1\n")
    words = []
    for change in ("robot.0.radius_m=0.3", "place.goals.1=[-3, -2]", "place.starts.0.1=-1"):
        words += ["--set", change]
    words += ["--set", "place.world.obstacles.0.velocity=[0, 0.1]", "--no-pictures", "--out", tmp_path / "r"]
    assert swarmscope("run", tmp_path / "s.yaml", *words).exit_code == 0
    config = read_config(tmp_path / "r")
    assert [sheet["radius_m"] for sheet in config["robot"]] == [0.3, 0.2]
    assert (config["place"]["goals"][1], config["place"]["starts"][0]) == ([-3, -2], [-2, -1, 0])
    assert config["place"]["world"]["obstacles"][0]["velocity"] == [0, 0.1]


def test_nothing_but_words_where_nobody_looks_at_a_terminal(tmp_path):
    done = swarmscope("run", "--task", "T1", "--robots", 1, "--limit", 1, "--no-pictures", "--out", tmp_path / "r")
    assert done.stderr == "" and "· 1 robot ·" in done.stdout


def test_a_setting_of_the_task_alone_means_t1(tmp_path):
    swarmscope("run", *SMALL[2:], "--set", "task.options.density=0.1", "--out", tmp_path / "r")
    assert read_config(tmp_path / "r")["task"]["name"] == "T1"


@pytest.mark.parametrize("name", ["doorway", "noisy_radio"])
def test_examples_arrive_without_collision(name, tmp_path):
    result = swarmscope("run", ROOT / f"examples/{name}.yaml", "--no-pictures", "--out", tmp_path / "r")
    metrics = read_metrics(tmp_path / "r")
    assert result.exit_code == 0
    assert (metrics["arrival_rate"], metrics["collisions"]) == (1.0, 0)


def test_five_robots_cross_a_real_building(tmp_path):
    out = tmp_path / "r"
    example = yaml.safe_load((ROOT / "examples/office.yaml").read_text())
    words = ("--map", example["map"]["file"], "--robots", 5, "--seed", example["seed"], "--limit", example["limit_s"])
    result = swarmscope("run", *words, "--out", out)
    metrics = read_metrics(out)
    assert result.exit_code == 0
    assert (metrics["arrival_rate"], metrics["collisions"]) == (1.0, 0)
    assert [o["type"] for o in read_world(out)["obstacles"]] == ["grid"]
    assert read_config(out)["map"]["file"] == "willow_garage_office"
    assert {entry.name for entry in out.iterdir()} == RUN_FILES


def test_a_map_beside_the_scenario_is_found_and_its_run_can_be_repeated(tmp_path, monkeypatch):
    (tmp_path / "maps").mkdir()
    solid = np.zeros((60, 240), np.uint8)
    solid[[0, -1]] = solid[:, [0, -1]] = 1
    save_map(grid_from_solid(solid, 0.05, (0.0, 0.0)), tmp_path / "maps/hall.yaml")
    (tmp_path / "maps/s.yaml").write_text("map: {file: hall.yaml, min_distance_m: 4}\nrobots: 2\nlimit_s: 3\n")
    swarmscope("run", tmp_path / "maps/s.yaml", "--no-pictures", "--out", tmp_path / "a")
    monkeypatch.chdir("/")
    swarmscope("run", tmp_path / "a/config.yaml", "--no-pictures", "--out", tmp_path / "b")
    assert (tmp_path / "a/trajectory.npz").read_bytes() == (tmp_path / "b/trajectory.npz").read_bytes()
    assert read_metrics(tmp_path / "a")["run"]["task"] == "hall"


WRONG = {
    "task": (["--task", "T9"], ["task.name", "unknown task 'T9'", "valid: "]),
    "planner": (["--planner", "nav-scop"], ["planner.name", "did you mean 'nav-scope'"]),
    "parameter": (["--set", "planner.params.w_ii=1"], ["parameter 'w_ii'", "did you mean 'w_i'"]),
    "infinite parameter": (["--set", "planner.params.w_i=.inf"], ["planner.params.w_i", "finite"]),
    "key": (["--set", "radio.los=1"], ["radio.los", "unknown key", "did you mean 'loss'"]),
    "group": (["--set", "planer.name=x"], ["planer", "did you mean 'planner'"]),
    "value": (["--set", "radio.loss=a lot"], ["radio.loss", "must be a number"]),
    "range": (["--set", "radio.loss=1.5"], ["radio.loss", "less than or equal to 1"]),
    "misspelt key instead of one that must be": (["--set", "map.flie=x"], ["map.flie: unknown key", "'file'"]),
    "group that is none": (["--set", "robot=3"], ["robot: must be keys with values, or a list", "not 3"]),
    "other number than sheets": (["--set", "robot=[{}, {}]", "--robots", 3], ["line: 2 data sheets", "leave 'robots'"]),
    "number in what is no list": (["--set", "robot.0.radius_m=1"], ["'robot' is not a list", "leave '.0' out"]),
    "number that is not there": (
        ["--set", "robot=[{}, {}]", "--set", "robot.2.radius_m=1"],
        ["'robot' is a list of 2: 'robot.0' to 'robot.1'"],
    ),
    "no number": (["--set", "robot=[{}]", "--set", "robot.radius_m=1"], ["'robot' is a list of 1: 'robot.0'"]),
    "in a list": (["--set", "robot=[{}]", "--set", "robot.0.radius=1"], ["robot.0.radius", "did you mean 'radius_m'"]),
    "path into a value": (["--seed", "1", "--set", "seed.x=1"], ["--set seed.x=1", "'seed' is not a group"]),
    "no equals": (["--set", "radio"], ["--set radio", "key.path=value"]),
    "empty key": (["--set", "radio..loss=1"], ["key.path=value"]),
    "no value": (["--set", "radio.loss={"], ["not valid YAML"]),
    "task option": (["--set", "task.options.densty=1"], ["unknown option 'densty'", "did you mean 'density'"]),
    "two places": (["--task", "T1", "--map", "willow_garage_office"], ["give one of them"]),
    "map": (["--map", "willow_garage_ofice"], ["unknown map", "did you mean 'willow_garage_office'"]),
    "map file": (["--map", "nowhere.yaml"], ["nowhere.yaml", "No such file"]),
    "robots": (["--robots", "0"], ["robots", "greater than or equal to 1"]),
    "limit": (["--limit", "-1"], ["limit_s", "greater than or equal to 0.001"]),
    "no file": (["nowhere.yaml"], ["nowhere.yaml", "No such file"]),
    "body": (["--set", "robot.half_width_m=2"], ["robot.half_width_m"]),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_named_with_its_place_and_the_nearest_name(case, tmp_path):
    words, parts = WRONG[case]
    said = refused("run", *words, "--out", tmp_path / "r")
    for part in parts:
        assert part in said
    assert not (tmp_path / "r").exists()


BROKEN = {
    "not yaml": ("task: {name: T1", "is not YAML"),
    "tab": ("task:\n\tname: T1", "is not YAML"),
    "date": ("seed: 2001-99-99", "is not YAML"),
    "list": ("- task", "a scenario is a mapping"),
    "empty": ("", "a scenario is a mapping"),
    "no place": ("place: null\nseed: 1", "exactly one of"),
    "two places": ("task: {name: T1}\nmap: {file: willow_garage_office}", "exactly one of"),
    "task is a word": ("task: T1", "task"),
    "binary": ("task: \x00", "is not YAML"),
    "deep": ("[" * 5000, "is not YAML"),
    "key that is a number": ("7: 8\ntask: {name: T1}", "7"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_files_are_refused_with_the_reason(case, tmp_path):
    text, reason = BROKEN[case]
    file = tmp_path / "s.yaml"
    file.write_text(text)
    said = refused("run", file, "--out", tmp_path / "r")
    assert reason in said and "s.yaml" in said


def test_a_folder_or_a_file_without_an_ending_is_no_map(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hall").mkdir()
    (tmp_path / "floor").touch()
    assert "hall: is a folder; a map is a file" in refused("run", "--map", "hall")
    assert "floor: has no ending that says what kind" in refused("run", "--map", "floor", "--resolution", 1)


def test_maps_scenarios_and_trips_in_each_others_places_are_told_apart(tmp_path):
    file = tmp_path / "map.yaml"
    file.write_text("image: a.png\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n")
    (tmp_path / "s.yaml").write_text("task: {name: T1}\n")
    assert f"is a map, not a scenario: run it with --map {file}" in refused("run", file)
    assert "is no scenario; a map is run with --map" in refused("run", tmp_path / "a.png")
    assert "is a scenario, not a map: run it without --map" in refused("run", "--map", tmp_path / "s.yaml")
    assert "holds trips: give it as map.trips, --trips" in refused("run", "--map", "a.scen", "--resolution", 1)


def test_a_file_that_is_not_text_is_refused(tmp_path):
    file = tmp_path / "s.yaml"
    file.write_bytes(b"\xff\xfe\x00task")
    assert "s.yaml: is not text" in refused("run", file)


PLACE = """
place:
  world: {{bounds: [-5, -5, 5, 5], obstacles: [{obstacles}]}}
  starts: [{starts}]
  goals: [{goals}]
robots: 2
"""
UNSOLVABLE = {
    "overlapping starts": ("", "[0, 0, 0], [0.1, 0, 0]", "[3, 0], [3, 2]", "their starts are 0.100 m apart"),
    "overlapping goals": ("", "[0, 0, 0], [0, 2, 0]", "[3, 0], [3, 0.2]", "their goals are 0.200 m apart"),
    "start in a tree": (
        "{type: circle, center: [0, 0], radius: 1}",
        "[0, 0, 0], [0, 2, 0]",
        "[3, 0], [3, 2]",
        "robot 0: its start",
    ),
    "walled in": (
        "{type: wall, points: [[2, -1], [4, -1], [4, 1], [2, 1], [2, -1]]}",
        "[0, 0, 0], [0, 2, 0]",
        "[0, -3], [3, 0]",
        "robot 1: no way from its start to its goal",
    ),
    "too few goals": ("", "[0, 0, 0], [0, 2, 0]", "[3, 0]", "as many starts and goals as robots"),
    "not finite": ("", "[0, 0, 0], [.nan, 2, 0]", "[3, 0], [3, 2]", "finite"),
}


@pytest.mark.parametrize("case", UNSOLVABLE)
def test_worlds_that_cannot_be_crossed_are_refused(case, tmp_path):
    obstacles, starts, goals, reason = UNSOLVABLE[case]
    file = tmp_path / "s.yaml"
    file.write_text(PLACE.format(obstacles=obstacles, starts=starts, goals=goals))
    assert reason in refused("run", file, "--out", tmp_path / "r")


def test_a_folder_with_other_things_is_not_touched_and_nothing_is_run(tmp_path, monkeypatch):
    monkeypatch.setattr(run_module, "run_scenario", lambda *_: pytest.fail("ran"))
    (tmp_path / "thesis.tex").write_text("precious")
    said = refused("run", *SMALL, "--out", tmp_path)
    assert "holds 'thesis.tex'" in said and "refusing to overwrite" in said


def test_an_earlier_run_is_replaced(tmp_path):
    for seed in (1, 2):
        swarmscope("run", *SMALL, "--seed", seed, "--force", "--out", tmp_path / "r")
    assert read_metrics(tmp_path / "r")["run"]["seed"] == 2
    assert [entry.name for entry in tmp_path.iterdir()] == ["r"]


def test_control_c_ends_with_130_and_one_line(tmp_path, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(run_module, "run_scenario", stop)
    result = swarmscope("run", *SMALL, "--out", tmp_path / "r")
    assert result.exit_code == 130
    assert result.stderr.strip() == "swarmscope: stopped; nothing of the unfinished run was kept"


def test_first_use_says_that_kernels_are_compiled(tmp_path, monkeypatch):
    monkeypatch.setattr(run_module, "kernels_are_cold", lambda planner: planner == "nav-scope")
    assert "compiling the kernels" in swarmscope("run", *SMALL, "--out", tmp_path / "a").stderr
    monkeypatch.undo()
    assert "compiling" not in swarmscope("run", *SMALL, "--out", tmp_path / "b").stderr


def test_kernels_are_cold_until_they_are_on_disk_however_old_they_are(tmp_path):
    def kernel():
        """Stands for one whose folder is that of its source's state."""

    compiled = SimpleNamespace(_cache=SimpleNamespace(cache_path=str(tmp_path)), py_func=kernel)
    assert warm_up._is_cold(compiled)
    index = tmp_path / f"{Path(__file__).stem}.kernel-1.py311.nbi"
    index.write_bytes(b"")
    os.utime(index, (1.0, 1.0))  # a checkout makes sources younger than what was compiled of them
    assert not warm_up._is_cold(compiled)


def test_progress_tells_simulated_time_and_robots():
    scenario = parse_scenario({"task": {"name": "T1"}, "limit_s": 60.0}, "test")
    with run_module.progress_bar(scenario) as progress:
        progress(10.0, 2)
        progress(59.8, 15)

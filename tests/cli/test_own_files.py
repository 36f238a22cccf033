"""Tasks and planners of one's own on the command line: new, run, --no-code, and what never runs them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from command_line import refused, swarmscope

from swarmscope import Body, Lidar, Robot, load_run
from swarmscope.errors import InputFileError
from swarmscope.judging.run_folder import RUN_FILES, read_config, read_metrics

SHORT = ["--robots", 2, "--limit", 1, "--set", "lidar.beams=90"]
EXPERIMENT = {
    "name": "mine",
    "title": "Mine",
    "seeds": "1000-1000",
    "scenario": {"robots": 2, "limit_s": 1.0},
    "places": {"ring": {"task": {"name": "ring.py"}}},
    "planners": {"nav": {"planner": {"name": "nav-scope"}}},
    "figures": ["paths"],
}


def refusal(*words):
    """The last line of a command that must fail."""
    result = swarmscope(*words)
    assert (result.exit_code, result.stdout) == (2, "")
    return result.stderr.strip().splitlines()[-1]


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with a new task."""
    monkeypatch.chdir(tmp_path)
    assert swarmscope("new", "task", "ring").exit_code == 0
    return tmp_path


@pytest.mark.parametrize("kind", ["task", "planner"])
def test_what_is_written_works_as_it_is(tmp_path, monkeypatch, kind):
    monkeypatch.chdir(tmp_path)
    result = swarmscope("new", kind, "my_own")
    assert "swarmscope run --" in result.stdout and result.exit_code == 0
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "test_my_own.py"],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-2000:]
    assert "there already" in refused("new", kind, "my_own")
    (tmp_path / "my_own.py").unlink()
    assert "test_my_own.py: is there already" in refused("new", kind, "my_own")
    assert not (tmp_path / "my_own.py").exists()


@pytest.mark.parametrize("name", ["3x", "a-b", "../x", "class", "", "a b", "é"])
def test_other_names_than_pythons_are_refused(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    assert "must be a Python name" in refused("new", "task", name)
    assert not list(tmp_path.iterdir())


def test_a_task_in_a_file_runs_and_is_kept_with_the_run(here):
    result = swarmscope("run", "--task", "ring.py", *SHORT, "--set", "task.options.length_m=6", "--out", "r")
    assert result.exit_code == 0, result.stderr
    assert f"runs the code in {here / 'ring.py'}" in result.stderr
    assert {entry.name for entry in (here / "r").iterdir()} == RUN_FILES | {"task.py"}
    assert (here / "r/task.py").read_text() == (here / "ring.py").read_text()
    config = read_config(here / "r")
    assert config["task"] == {"name": str(here / "ring.py"), "options": {"length_m": 6.0, "pillar_m": 0.5}}
    assert read_metrics(here / "r")["run"]["task"] == "ring"
    (here / "ring.py").write_text("raise RuntimeError('is not run')\n")
    assert swarmscope("replay", "r").exit_code == 0
    load_run(here / "r").save(here / "copy", pictures=False)
    assert (here / "copy/task.py").read_text() == (here / "r/task.py").read_text()


def test_a_file_of_a_scenario_lies_beside_it(here, tmp_path_factory, monkeypatch):
    (here / "s.yaml").write_text(yaml.safe_dump({"task": {"name": "ring.py"}, "robots": 2, "limit_s": 0.4}))
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    result = swarmscope("run", here / "s.yaml", "--out", here / "r", "--no-pictures")
    assert result.exit_code == 0, result.stderr
    again = swarmscope("run", here / "r/config.yaml", "--out", here / "again", "--no-pictures")
    assert again.exit_code == 0, again.stderr
    assert read_config(here / "again") == read_config(here / "r")


def test_no_code_refuses_files_and_does_not_run_them(here):
    (here / "ring.py").write_text("raise RuntimeError('is not run')\n")
    for words in (["run", "--task", "ring.py"], ["run", "--planner", "ring.py", "--set", "planner.model=x"]):
        assert f"--no-code: {here / 'ring.py'} is a user's file" in refused(*words, "--no-code", *SHORT)
    (here / "e.yaml").write_text(yaml.safe_dump(EXPERIMENT))
    assert "--no-code" in refused("experiment", "run", "e.yaml", "--no-code")
    assert "--no-code" in refused("experiment", "report", "e.yaml", "--no-code")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = (", "is not Python: line 1"),
        ("import sys\nsys.exit(0)", "raised SystemExit in line 2: 0"),
        ("NAME = 'x'\nSUMMARY = ''\nmake = print", "line 2: SUMMARY is '', wanted a line of text"),
        ("NAME = SUMMARY = 'x'\nmake = 3", "line 2: make is 3, wanted a function"),
        ("NAME = SUMMARY = 'x'\ndef make(seed, robots, radius): 1 / 0", "raised ZeroDivisionError in line 2"),
        ("NAME = SUMMARY = 'x'\ndef make(seed, robots, radius): return 3", "make returned int, wanted a Setup"),
        ("NAME = SUMMARY = 'x'\ndef make(seed, robots, radius, **more): pass", "declare them in a dataclass OPTIONS"),
        ("NAME = SUMMARY = 'x'\ndef make(seed, robots, radius, a): pass", "make: 'a' has no default"),
        ("NAME = SUMMARY = 'x'\nOPTIONS = 3\ndef make(seed, robots, radius): pass", "OPTIONS: is not a dataclass"),
        ("NAME = SUMMARY = 'x'\ndef make(seed): pass", "raised TypeError"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_in_a_line(here, text, said):
    (here / "ring.py").write_text(text + "\n")
    message = refusal("run", "--task", "ring.py", *SHORT, "--out", "r", "--no-pictures")
    assert "ring.py: " in message and said in message


def test_a_setup_that_does_not_fit_is_refused(here):
    made = "from swarmscope.tasks import Setup, WorldSpec\nNAME = SUMMARY = 'x'\ndef make(seed, robots, radius):\n"
    wrong = {"[[0, 0]]": "shape (1, 2), wanted (2, 3)", "'here'": "not numbers", "[[0, 0, 0]] * 2": "robot"}
    for starts, said in wrong.items():
        setup = f"Setup(WorldSpec(bounds=(-9, -9, 9, 9)), {starts}, [[1, 0], [2, 0]])"
        (here / "ring.py").write_text(f"{made}    return {setup}\n")
        assert said in refusal("run", "--task", "ring.py", *SHORT, "--out", "r", "--no-pictures")


def test_an_experiment_with_a_file_is_reported_without_running_it(here):
    (here / "e.yaml").write_text(yaml.safe_dump(EXPERIMENT))
    result = swarmscope("experiment", "run", "e.yaml", "--engine", "in-process")
    assert result.exit_code == 0, result.stderr
    assert f"runs the code in {here / 'ring.py'}" in result.stderr
    trap = here / "ring.py"
    text, about = trap.read_text(), trap.stat()
    mark = here / "was_run"
    run_again = swarmscope("experiment", "report", "e.yaml")
    assert run_again.exit_code == 0
    assert "is not run for a report" in (here / "runs/mine/report/report.md").read_text()
    trap.write_text(f"open({str(mark)!r}, 'w')\n" + text)
    for command in ("report", "status"):
        assert swarmscope("experiment", command, "e.yaml").exit_code == 0
    assert not mark.exists() and about.st_size


def test_the_command_lists_tasks_with_their_options():
    assert "density=0.35" in swarmscope("tasks").stdout
    assert Path("ring.py").name not in swarmscope("tasks").stdout


HEAD = "from swarmscope.kit import jit\nNAME = SUMMARY = NEEDS = 'x'\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("def decide(see, memory, params):\n    1 / 0", "raised ZeroDivisionError in line 4"),
        ("def decide(see, memory, params):\n    see.percept['goal']", "in line 4: no field of name goal"),
        ("def decide(see, memory, params): see.out['state'] = 77", "decide set state 77, there are 0 to "),
        ("def decide(see, memory, params): see.out['reason'] = 99", "decide set reason 99, there are 0 to "),
        ("def decide(see, memory): pass", "line 3: decide is (see, memory), wanted a function (see, memory, params)"),
        ("@jit\ndef decide(see, memory, params):\n    see.percept['goal']", "does not compile in line 5: Field 'goal'"),
    ],
)
def test_what_is_wrong_with_a_decision_is_said_in_a_line(tmp_path, monkeypatch, text, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(HEAD + text + "\n")
    message = refusal("run", "--task", "T1", "--planner", "mine.py", *SHORT, "--out", "r", "--no-pictures")
    assert "mine.py: " in message and said in message
    assert len(message) < 400
    with pytest.raises(InputFileError, match="mine"):
        Robot("mine.py", Body(), Lidar(90), address=1).warm_up()

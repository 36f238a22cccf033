"""What no input may do: end in a traceback, hang, or be told without the file, key or line."""

from __future__ import annotations

import errno
import math
import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest
from command_line import refused, swarmscope

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from fuzz_inputs import fuzz
from swarmscope.cli._errors import FAULT, TRACEBACK, _words
from swarmscope.errors import SwarmscopeError
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.tasks import load_task, task_names
from swarmscope.tasks._contract import option_fields

TREES = ["run", "--task", "T1", "--robots", "2"]


def test_a_part_of_the_fuzzing():
    told = []
    found = fuzz(range(20), 11, told.append)
    assert found["FAULTS"] == 0, "\n".join(told)
    assert sum(found.values()) == 20


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ("lidar.fov_deg=1e-300", "lidar.fov_deg"),
        ("limit_s=1e-300", "limit_s"),
        ("limit_s=1e300", "limit_s"),
        ("robot.radius_m=1e9", "robot.radius_m"),
        ("robot.v_max_mps=1e-300", "robot.v_max_mps"),
        ("lidar.rate_hz=1e-300", "lidar.rate_hz"),
        ("guard.clearance_m=1e9", "guard.clearance_m"),
        ("radio.bitrate_bps=1e-300", "radio.bitrate_bps"),
        ("task.options.size_m=1e9", "size_m"),
        ("task.options.density=1e9", "density"),
        ("task.options.density=900", "density: 360000 trees do not fit"),
        ("robots=true", "robots"),
        ("robots=1_0", "1_0"),
        ("robots=1:30", "1:30"),
        ("task.options.size_m=\u0663", "size_m"),
        ("lidar.fov_deg=29", "lidar.fov_deg"),
    ],
)
def test_values_that_were_tracebacks_or_hangs_name_their_key(change, key):
    assert key in refused(*TREES, "--set", change)


@pytest.mark.parametrize("name", task_names())
def test_minus_zero_is_zero(name):
    """As a length it made a random generator fail: -0.0 is not below 0.0, and less than it."""
    for key, field in option_fields(load_task(name)).items():
        if field.kind is not float or field.bounds.low > 0.0:
            continue
        said = []
        for value in (0.0, -0.0):
            with suppress(SwarmscopeError):
                scenario = parse_scenario({"task": {"name": name, "options": {key: value}}, "robots": 2}, "test")
                said.append(make_setup(scenario).starts.tolist())
        assert len(said) in (0, 2) and said[:1] == said[1:]
    noise = parse_scenario({"task": {"name": name}, "noise": {"nan": -0.0}}, "test").noise
    assert math.copysign(1.0, noise.nan) == 1.0


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["run", "a" * 5000 + ".yaml"], "aa.yaml: cannot be read (File name too long)"),
        (["run", "--task", "T1", "--planner", "b" * 5000], "unknown planner"),
        (["run", "--task", "T1", "--set", "c" * 5000 + "=1"], "cc"),
    ],
)
def test_very_long_names_are_not_repeated_whole(argv, words):
    said = refused(*argv)
    assert words in said
    assert len(said) < 1200


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["lidar.beams=4096", "lidar.fov_deg=30"], "lidar.fov_deg: 4096 beams in 30 degrees are too close"),
        (["lidar.beams=4096", "robots=200000"], "robots: 200000 robots with 4096 beams each need more than 3 GB"),
        (["robots=100000", "limit_s=1e6"], "limit_s: 100000 robots for 5000000 scans need more than 20 GB"),
        (["robots=3000", "limit_s=1e4", "record_scans='yes'"], "record_scans: 3000 robots, 50000 scans of 360 beams"),
    ],
)
def test_products_that_cost_too_much_name_their_keys(changes, words):
    assert words in refused(*TREES, *(word for change in changes for word in ("--set", change)))


@pytest.mark.parametrize(
    ("task", "option"),
    [("u_trap", "depth_m=1e9"), ("GIWT_2", "fewest=1e9"), ("GIWT_2", "most=1e9"), ("corridor", "length_m=1e9")],
)
def test_options_of_tasks_have_bounds(task, option):
    assert option.partition("=")[0] in refused("run", "--task", task, "--set", f"task.options.{option}")


@pytest.mark.parametrize(
    ("size", "words"), [("2", "most: 1000 obstacles do not fit"), ("6", "lower 'most' or 'robots', or enlarge the map")]
)
def test_obstacles_for_which_there_is_no_room_are_told_soon(size, words):
    changes = ("task.options.fewest=1000", "task.options.most=1000", f"task.options.size_m={size}")
    said = refused("run", "--task", "GIWT_2", "--robots", "2", *(w for c in changes for w in ("--set", c)))
    assert words in said


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("bounds: [-50000, -50000, 50000, 50000]", "place: bounds, starts and goals span 100004 m x 100004 m"),
        ("bounds: [0, 0, 9, 1e300]", "place.world.bounds.3"),
        ("bounds: [0, 0, 9, 9]}, starts: [[1.0e+30, 1, 0]], goals: [[2, 2]], #", "place.starts.0.0"),
        ("bounds: [0, 0, 9, 9]}, starts: [[1, 1, 0]], goals: [[9.0e+4, 9.0e+4]], #", "place: bounds, starts and goals"),
    ],
)
def test_worlds_that_are_too_large_are_told(place, words, tmp_path):
    file = tmp_path / "s.yaml"
    head = f"robots: 1\nplace: {{world: {{obstacles: [], {place}"
    file.write_text(head.rstrip("#") + ("}" if "#" in place else "}, starts: [[1, 1, 0]], goals: [[2, 2]]}") + "\n")
    assert words in refused("run", file)


def test_aliases_that_stand_for_billions_are_told(tmp_path):
    file = tmp_path / "bomb.yaml"
    lines = ["a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"{chr(98 + k)}: &{chr(98 + k)} [{', '.join(['*' + chr(97 + k)] * 9)}]" for k in range(9)]
    file.write_text("\n".join(lines))
    assert "its aliases stand for 4.41e+09 values" in refused("run", file)
    file.write_text("a: &a [*a]")
    assert "an alias stands within what it stands for" in refused("run", file)
    file.write_text("robots: &n 2\nseed: *n\ntask: {name: swap}\nlimit_s: 0.2\n")
    assert swarmscope("run", file, "--out", tmp_path / "r", "--no-pictures").exit_code == 0


def test_places_where_no_folder_can_be_are_told_before_the_run(tmp_path):
    (tmp_path / "loop").symlink_to("loop")
    os.mkfifo(tmp_path / "pipe")
    assert "a link that leads nowhere, or in a circle" in refused("run", "--out", tmp_path / "loop")
    assert "is no folder" in refused("run", "--out", tmp_path / "pipe" / "r")
    assert "is no regular file" in refused("experiment", "status", "traps", "--store", tmp_path / "pipe")
    assert "is no regular file" in refused("storm", "--runs", "1", "--into", tmp_path / "pipe")


def test_a_full_or_closed_output_is_told():
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "swarmscope", "disk", "list"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert (done.returncode, done.stderr) == (2, "swarmscope: disk: the output cannot be written: the disk is full\n")


def test_with_all_streams_closed_a_controller_still_finds_its_judge(tmp_path):
    (tmp_path / "out.py").write_text(
        "def compute_gradients(state, targets, obstacles, r):\n    print('hello')\n    return 0 * state + [[1, 0]]\n"
    )
    words = f"'{sys.executable}' -m swarmscope disk run out.py --out r <&- >&- 2>&-"
    assert subprocess.run(["sh", "-c", words], cwd=tmp_path, check=False).returncode == 1
    assert (tmp_path / "r" / "report.html").is_file()


def test_errors_of_the_system_and_of_libraries_are_one_line_with_what_was_read(monkeypatch):
    monkeypatch.delenv(TRACEBACK, raising=False)
    words = ["run", "s.yaml", "--robots", "3"]
    assert _words(MemoryError(), words)[0].startswith("run s.yaml: there is not enough memory")
    assert _words(OSError(errno.ENOSPC, "No space", "/a/b"), words) == ("/a/b: the disk is full", 2)
    try:
        {}[words[1]]
    except KeyError as error:
        said, code = _words(error, words)
    assert code == FAULT
    assert said.startswith("run s.yaml: a fault of swarmscope itself: KeyError: 's.yaml' (test_hostile")

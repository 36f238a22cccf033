"""``perceive``, ``replay``, ``planners``, ``tasks``, ``--help``, ``--version``."""

from __future__ import annotations

import csv
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
import typer
from command_line import SMALL, refused, swarmscope
from typer.testing import CliRunner

import swarmscope as package
from swarmscope.cli.main import app
from swarmscope.sim.scan_files import SCAN_FOLDER

ROOT = Path(__file__).parents[2]
SCANS = "malaga_telecom_2006_sick_lms"
COMMANDS = ("run", "perceive", "replay", "mcap", "video", "planners", "tasks")


def test_perceive_takes_the_packaged_scans_and_writes_features_and_picture(tmp_path):
    result = swarmscope("perceive", SCANS, "--out", tmp_path / "p")
    assert result.exit_code == 0
    for words in (SCANS, "225", "361 over 180 degrees", "5 m", "time of a scan, median", "us", "bytes"):
        assert words in result.stdout
    rows = list(csv.DictReader((tmp_path / "p/features.csv").open()))
    assert len(rows) > 100
    assert all(0.0 < float(row["distance_m"]) <= 5.0 for row in rows)
    assert (tmp_path / "p/perceive.png").read_bytes().startswith(b"\x89PNG")


def test_perceive_takes_a_file_and_every_third_beam(tmp_path):
    result = swarmscope("perceive", SCAN_FOLDER / f"{SCANS}.npz", "--beam-step", 3, "--range", 20)
    assert result.exit_code == 0
    assert "121 over 180 degrees" in result.stdout and "20 m" in result.stdout


HEADER = {"angle_min": -1.0, "angle_increment": 0.1, "range_min": 0.05, "range_max": 10.0}


def _write(path, **arrays):
    np.savez(path, **(HEADER | arrays))
    return path


def test_perceive_refuses_bad_scan_files(tmp_path):
    nan = _write(tmp_path / "nan.npz", ranges_m=np.full((3, 20), np.nan, np.float32))
    assert "only NaN" in refused("perceive", nan)
    none = _write(tmp_path / "none.npz", ranges_m=np.zeros((0, 20), np.float32))
    assert "at least 1" in refused("perceive", none)
    one = _write(tmp_path / "one.npz", ranges_m=np.ones((3, 1), np.float32))
    assert "two beams" in refused("perceive", one)
    empty = tmp_path / "empty.npz"
    empty.touch()
    assert "is empty" in refused("perceive", empty)
    torn = tmp_path / "torn.npz"
    torn.write_bytes((SCAN_FOLDER / f"{SCANS}.npz").read_bytes()[:9000])
    assert "torn" in refused("perceive", torn)
    assert "No such file" in refused("perceive", tmp_path / "nowhere.npz")
    assert "unknown scans 'malaga'" in refused("perceive", "malaga")


@pytest.mark.parametrize("words", [("--range", "0"), ("--range", "nan"), ("--radius", "-1"), ("--range", "0.01")])
def test_perceive_refuses_impossible_robots(words, tmp_path):
    scans = _write(tmp_path / "s.npz", ranges_m=np.ones((2, 20), np.float32))
    assert words[0].strip("-") in refused("perceive", scans, *words)


def test_perceive_says_when_it_cannot_write(tmp_path):
    (tmp_path / "file").touch()
    result = swarmscope("perceive", SCANS, "--out", tmp_path / "file")
    assert result.exit_code == 2 and "is a file; features and the picture go into a folder" in result.stderr


def test_replay_makes_page_and_picture_anew(tmp_path):
    out = tmp_path / "r"
    swarmscope("run", *SMALL, "--out", out)
    assert not (out / "replay.html").exists()
    result = swarmscope("replay", out)
    assert result.exit_code == 0
    assert result.stdout.split() == [str(out / "paths.png"), str(out / "replay.html")]
    assert (out / "replay.html").read_text().startswith("<!doctype html>") and (out / "paths.png").exists()


def test_replay_opens_the_page_when_asked(tmp_path, monkeypatch):
    out = tmp_path / "r"
    swarmscope("run", *SMALL, "--out", out)
    opened = []
    monkeypatch.setattr("swarmscope.cli.main.typer.launch", opened.append)
    swarmscope("replay", out, "--open")
    assert opened == [(out / "replay.html").resolve().as_uri()]


def test_replay_refuses_what_is_no_finished_run(tmp_path):
    out = tmp_path / "r"
    swarmscope("run", *SMALL, "--out", out)
    (tmp_path / "empty").mkdir()
    assert "metrics.json" in refused("replay", tmp_path / "empty")
    assert "nowhere" in refused("replay", tmp_path / "nowhere")
    for name in ("metrics.json", "world.json", "trajectory.npz"):
        copy = tmp_path / f"without-{name}"
        shutil.copytree(out, copy)
        (copy / name).unlink()
        assert name in refused("replay", copy)
        (copy / name).write_bytes((out / name).read_bytes()[:-40])
        assert name in refused("replay", copy)


def test_planners_lists_parameters_with_defaults_and_meaning():
    result = swarmscope("planners")
    assert result.exit_code == 0
    for words in ("nav-scope", "is given", "w_i", "0 is Nav-I", "patience_s", "Speed below which"):
        assert words in result.stdout
    assert "``" not in result.stdout


def test_tasks_lists_tasks_with_their_options():
    result = swarmscope("tasks")
    assert result.exit_code == 0
    for words in ("T1", "T2", "T3", "swap", "density=0.35", "--set task.options.density"):
        assert words in result.stdout


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_every_command_has_an_example(command):
    result = swarmscope(command, "--help")
    assert result.exit_code == 0
    assert f"swarmscope {command}" in result.stdout.partition("Example")[2]


def test_help_lists_all_commands_and_no_arguments_show_it():
    assert all(f" {command} " in swarmscope("--help").stdout for command in COMMANDS)
    assert "Usage" in CliRunner().invoke(app, []).output


def commands_in(group, before=()):
    """Every command below a group, with the words that call it."""
    for name, one in group.commands.items():
        yield from commands_in(one, (*before, name)) if hasattr(one, "commands") else [((*before, name), one)]


def test_examples_of_help_can_be_copied():
    """Each is a command that there is, with options and values that it takes; what it names of the clone is there."""
    command = typer.main.get_command(app)
    known, seen = dict(commands_in(command)), 0
    for one in known.values():
        for example in re.findall(r"\[bold](.*?)\[/bold]", one.epilog or ""):
            for part in example.split(";"):
                words = shlex.split(part.partition(">")[0])
                if words[0] != "swarmscope":
                    continue
                called = next(name for name in known if tuple(words[1 : 1 + len(name)]) == name)
                known[called].make_context(words[1], words[1 + len(called) :])
                seen += 1
                assert all((ROOT / word).exists() for word in words if word.startswith("examples/")), example
    assert seen > 25


def test_version():
    assert swarmscope("--version").stdout == f"swarmscope {package.__version__}\n"


def test_a_mistyped_command_is_named():
    result = CliRunner().invoke(app, ["rn"])
    assert result.exit_code == 2 and "did you mean 'run'" in result.stderr.lower()


def test_no_word_of_a_help_text_is_lost_as_markup():
    """Rich takes [m] for markup, and says nothing."""
    command = typer.main.get_command(app)
    texts = [option.help or "" for one in command.commands.values() for option in one.params if hasattr(option, "help")]
    assert len(texts) > 50
    assert not [text for text in texts if re.search(r"\[[a-z/]", text)]

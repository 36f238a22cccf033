"""``swarmscope run --mcap``, ``swarmscope mcap``, ``swarmscope video``."""

from __future__ import annotations

import pytest
from command_line import SMALL, refused, swarmscope

from swarmscope.judging.run_folder import REQUIRED
from swarmscope.viewing.bag import make


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    out = tmp_path_factory.mktemp("runs") / "r"
    result = swarmscope("run", *SMALL, "--mcap", "--out", out)
    assert result.exit_code == 0
    assert result.stdout.splitlines()[-2:] == [str(out / "metrics.json"), str(out / "run.mcap")]
    return out


def test_the_file_of_a_finished_run_is_that_of_the_run_itself(run, tmp_path):
    assert {entry.name for entry in run.iterdir()} == REQUIRED | {"run.mcap"}
    result = swarmscope("mcap", run, "-o", tmp_path / "again.mcap")
    assert result.stdout == f"{tmp_path / 'again.mcap'}\n"
    assert (tmp_path / "again.mcap").read_bytes() == (run / "run.mcap").read_bytes()


def test_folder_with_video_and_bag_is_still_one_of_a_run(run):
    assert swarmscope("video", run, "--speed", 4, "--fps", 2, "--size", 200).stdout == f"{run / 'video.gif'}\n"
    assert (run / "video.gif").read_bytes().startswith(b"GIF89a")
    assert swarmscope("run", *SMALL, "--out", run).exit_code == 0
    assert {entry.name for entry in run.iterdir()} == REQUIRED  # those of the former run are gone with it


def test_refusals(run, tmp_path, monkeypatch):
    assert "no such run folder" in refused("mcap", tmp_path / "nowhere")
    assert "no such run folder" in refused("video", tmp_path / "nowhere", "-o", tmp_path / "a.gif")
    assert "ends with .mcap" in refused("mcap", run, "-o", tmp_path / "a.bag")
    assert "ends with .gif or .mp4" in refused("video", run, "-o", tmp_path / "a.webm")
    monkeypatch.setattr(make, "find_spec", lambda name: None)
    assert "pip install 'swarmscope[bags]'" in refused("mcap", run)
    assert "pip install 'swarmscope[bags]'" in refused("run", *SMALL, "--mcap", "--out", tmp_path / "r")
    assert not (tmp_path / "r").exists()


def test_a_users_planner_is_announced_and_can_be_refused(tmp_path):
    planner = tmp_path / "mine.py"
    planner.write_text(
        'NAME, SUMMARY, NEEDS = "mine", "stands", "nothing"\n\n\ndef decide(see, memory, params):\n    pass\n'
    )
    words = ("run", *SMALL, "--planner", planner, "--mcap", "--out", tmp_path / "r")
    assert swarmscope(*words).exit_code == 0
    assert f"runs the code in {planner}" in swarmscope("mcap", tmp_path / "r").stderr
    assert "is a user's file, whose code is not run" in refused("mcap", tmp_path / "r", "--no-code")

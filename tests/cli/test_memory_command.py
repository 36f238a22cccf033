"""``swarmscope memory`` and ``swarmscope replay --memory`` as people type them."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import refused, swarmscope

RUN = ("run", "--task", "u_trap", "--robots", 1, "--planner", "atlas", "--limit", 60)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("memory") / "trap"
    assert swarmscope(*RUN, "--out", out).exit_code == 0
    return out


def test_a_search_is_drawn_and_told(folder):
    result = swarmscope("memory", folder)
    assert result.exit_code == 0
    told, picture = result.stdout.splitlines()[-2:]
    assert told.startswith("robot 0 at ") and "m off the old one" in told
    assert Path(picture) == folder / "memory.png" and Path(picture).read_bytes().startswith(b"\x89PNG")


def test_the_page_is_made_with_maps_and_without(folder):
    page = folder / "replay.html"
    assert swarmscope("replay", folder, "--memory").exit_code == 0
    assert '"memory_moments"' in page.read_text("utf-8")
    assert swarmscope("replay", folder).exit_code == 0
    assert '"memory_moments"' not in page.read_text("utf-8")


def test_what_is_not_there_is_named(folder, tmp_path):
    assert "--robot: 7: this run has robots 0 to 0" in refused("memory", folder, "--robot", 7)
    assert "--number: 500: there are" in refused("memory", folder, "--number", 500)
    assert "no finished run" in refused("memory", tmp_path)
    plain = tmp_path / "plain"
    assert swarmscope("run", "--task", "T1", "--robots", 1, "--limit", 3, "--out", plain).exit_code == 0
    assert "keeps no map" in refused("memory", plain)

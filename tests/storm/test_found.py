"""Runs that storms have found, once with a contact: each is played longer than then, and nobody is touched any more."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmscope.storm.breach_file import read_case
from swarmscope.storm.draw import Case
from swarmscope.storm.play import watched

FOUND = Path(__file__).parent / "found"
OPEN: dict[str, str] = {}
"""What still touches something, and why."""
LONGER = 3.0
"""They ended with the contact; now they go on for as many times as long, at least a minute."""


def case_of(file):
    why = OPEN.get(file.stem)
    marks = [] if why is None else [pytest.mark.xfail(reason=why, strict=True)]
    return pytest.param(file, id=file.stem, marks=marks)


@pytest.mark.parametrize("file", [case_of(file) for file in sorted(FOUND.glob("*.yaml"))])
def test_what_a_storm_has_found_touches_nothing_any_more(file):
    case = read_case(file)
    longer = max(60.0, LONGER * case.values["limit_s"])
    assert watched(Case(case.values | {"limit_s": longer}, case.forger)).breach is None

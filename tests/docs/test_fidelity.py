"""The documents item by item: all that the page names exists, keys can be set, figures are those of their sources."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

from swarmscope.errors import SwarmscopeError
from swarmscope.learning.config import parse_config
from swarmscope.onboard.planners import load_planner
from swarmscope.scenarios.overrides import read_value, set_key
from swarmscope.scenarios.read import parse_scenario

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
FIGURE = re.compile(r"(?<![\w.])\d+(?:[.,]\d+)*")


def page_maker():
    spec = importlib.util.spec_from_file_location("fidelity_page", DOCS / "fidelity.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


MAKER = page_maker()
DOCUMENTS = MAKER.documents()
ROWS = [pytest.param(of, row, id=f"{of.letter}-{row.item}") for of in DOCUMENTS for row in of.rows]
KEYS = sorted({(of.name, of.planners, key) for of in DOCUMENTS for row in of.rows for key in row.preset})


def test_the_page_is_fresh():
    fresh = (DOCS / "fidelity.md").read_text(encoding="utf-8") == MAKER.page()
    assert fresh, "docs/fidelity.md is stale: run 'python docs/fidelity.py'"


def test_all_four_documents_are_there_item_by_item():
    assert [of.name for of in DOCUMENTS] == ["Nav-SCOPE", "SFM-MAS", "GIWT", "Unit-disk report"]
    assert sum(len(of.rows) for of in DOCUMENTS) >= 145
    for of in DOCUMENTS:
        items = [row.item for row in of.rows]
        assert len(set(items)) == len(items), of.name


@pytest.mark.parametrize(("name", "last"), [("Nav-SCOPE", 24), ("SFM-MAS", 27), ("GIWT", 10), ("Unit-disk report", 3)])
def test_every_numbered_equation_has_a_row(name, last):
    (of,) = (of for of in DOCUMENTS if of.name == name)
    numbers = set()
    for row in of.rows:
        for first, end in re.findall(r"\((\d+)\)(?:-\((\d+)\))?", row.item):
            numbers |= set(range(int(first), int(end or first) + 1))
    assert numbers >= set(range(1, last + 1)), set(range(1, last + 1)) - numbers


@pytest.mark.parametrize(("of", "row"), ROWS)
def test_every_file_and_symbol_exists(of, row):
    assert list(MAKER.places(row)) or row.state == "missing"


@pytest.mark.parametrize(("of", "row"), ROWS)
def test_what_a_state_asks_for_is_said(of, row):
    assert row.state in MAKER.STATES
    assert row.remark or row.state == "faithful"
    assert row.effect or row.state != "deviates"
    if row.state == "reading":
        assert any(place.file.startswith("tests/") for place in MAKER.places(row)), "names no test"
    if row.state == "deviates":
        assert bool(row.preset) != row.remark.startswith(MAKER.NO_KEY), "keys, or why there are none"


@pytest.mark.parametrize(("name", "planners", "key"), KEYS)
def test_every_key_can_be_set(name, planners, key):
    if key == MAKER.PRINTED:
        assert planners
        return
    if key.startswith("train: "):
        option, _, value = key.removeprefix("train: ").partition("=")
        parse_config({option: read_value(value, key)}, key)
        return
    takes = [planner for planner in planners if can_be_set(planner, key)]
    assert takes, f"{name}: no planner of it takes {key}"


def can_be_set(planner, key):
    values = {"task": {"name": "T1"}, "planner": {"name": planner}}
    set_key(values, key)
    try:
        load_planner(planner).params(parse_scenario(values, key).planner.params)
    except SwarmscopeError:
        return False
    return True


def test_keys_that_do_not_exist_or_are_out_of_bounds_are_noticed():
    assert can_be_set("nav-scope", "planner.params.turn_back=6.2831")
    assert not can_be_set("nav-scope", "planner.params.turn_back=100")
    assert not can_be_set("nav-scope", "planner.params.turn=2")
    assert not can_be_set("nav-scope", "safety.no_such_key=1")


@pytest.mark.parametrize(("of", "row"), ROWS)
def test_every_figure_is_in_its_source(of, row):
    measured = bool(row.effect) and row.effect != MAKER.UNMEASURED
    assert bool(row.source) == measured
    if not measured:
        return
    file, _, anchor = row.source.partition("#")
    section = MAKER.anchors(DOCS / file)[anchor]
    figures = set(FIGURE.findall(row.effect))
    assert figures <= set(FIGURE.findall(section)), figures - set(FIGURE.findall(section))


def test_lines_are_those_of_the_symbols():
    found = MAKER.symbols("docs/fidelity.py")
    lines = (DOCS / "fidelity.py").read_text(encoding="utf-8").splitlines()
    assert lines[found["page"] - 1] == "def page() -> str:"
    assert lines[found["Row.preset"] - 1].startswith("    preset: ")
    assert lines[found["STATES"] - 1] == "STATES = {"


@pytest.mark.parametrize(
    "entry", ["onboard/no_file.py: x", "onboard/body.py: no_symbol", "onboard/body.py", "docs/theory.md: x"]
)
def test_places_that_are_wrong_are_named(entry):
    row = MAKER.Row("an item", "faithful", (entry,))
    with pytest.raises(SystemExit, match="an item"):
        list(MAKER.places(row))


def test_other_pages_lead_here():
    assert "(docs/fidelity.md)" in (ROOT / "README.md").read_text(encoding="utf-8")
    block = (DOCS / "theory.md").read_text(encoding="utf-8").split("## Where we differ")[1]
    assert "(fidelity.md)" in block

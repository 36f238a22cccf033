"""Members: found in a folder, by entry points and in files, by one rule; and the bounds of what can be set."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import pytest

from swarmscope import members
from swarmscope.bounds import Bounds, about, converted, fields_of, fields_of_function
from swarmscope.errors import ConfigError, InputFileError, UnknownNameError
from swarmscope.members import Kind, Need, find, load, names_of, text, told_by

KIND = Kind("dish", "dishes", "test.dishes", (text("NAME"), Need("cook", "a function", callable)))
GOOD = "NAME = 'soup'\ndef cook(): pass\n"


@pytest.fixture
def dishes(tmp_path, monkeypatch):
    """A package with two members, and one more file that is none."""
    folder = tmp_path / "dishes"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "_salt.py").write_text("raise RuntimeError")
    (folder / "soup.py").write_text(GOOD + "VARIANTS = {'broth': 1, 'stew': 2}\n")
    (folder / "bad.py").write_text("NAME = 'bad-dish'\n\ncook = 3\n")
    monkeypatch.syspath_prepend(tmp_path)
    members._shipped.cache_clear()
    members._installed.cache_clear()
    yield folder
    for name in [n for n in sys.modules if n.partition(".")[0] in ("dishes", "guest")]:
        del sys.modules[name]
    members._shipped.cache_clear()
    members._installed.cache_clear()


def test_members_of_the_folder_are_found_without_importing_them(dishes):
    assert names_of(KIND) == ["bad-dish", "broth", "soup", "stew"]
    assert find(KIND, "stew") == ("stew", "dishes.soup", dishes / "soup.py")
    assert "dishes.soup" not in sys.modules
    assert load(KIND, "broth") is load(KIND, "soup")
    with pytest.raises(UnknownNameError, match="unknown dish 'sop'; did you mean 'soup'"):
        load(KIND, "sop")
    with pytest.raises(UnknownNameError):
        load(KIND, "_salt")


def test_what_a_file_lacks_is_said_with_its_line(dishes, tmp_path):
    with pytest.raises(InputFileError, match=r"bad\.py: line 3: cook is 3, wanted a function"):
        load(KIND, "bad-dish")
    (tmp_path / "mine.py").write_text("def cook(): pass\n")
    with pytest.raises(InputFileError, match=r"mine\.py: has no NAME \(a line of text\), which every dish defines"):
        load(KIND, str(tmp_path / "mine.py"))


def test_a_file_and_what_it_says_of_itself(dishes, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(GOOD + "SUMMARY: str = 'hot'\n")
    assert load(KIND, str(path)).NAME == "soup"
    assert find(KIND, str(path)).module is None
    path.write_text("raise RuntimeError\nSUMMARY = 'hot'\n")
    assert (told_by(path, "SUMMARY"), told_by(path, "NEEDS")) == ("hot", "")


def test_entry_points_name_modules(dishes, tmp_path, monkeypatch):
    (tmp_path / "guest.py").write_text(GOOD.replace("soup", "cake"))
    points = {
        "cake": "guest", "soup": "guest", "gone": "no_such_module", "twice": "guest"
    }  # fmt: skip
    listed = [EntryPoint(name, value, KIND.group) for name, value in points.items()]
    listed.append(EntryPoint("twice", "guest2", KIND.group))
    monkeypatch.setattr(members, "entry_points", lambda group: listed if group == KIND.group else [])
    members._installed.cache_clear()
    assert names_of(KIND) == ["bad-dish", "broth", "cake", "gone", "soup", "stew", "twice"]
    assert load(KIND, "cake").NAME == "cake" and find(KIND, "cake").file == tmp_path / "guest.py"
    assert load(KIND, "soup").__name__ == "dishes.soup"  # ours go first
    with pytest.raises(ConfigError, match="dish 'twice': is in several installed packages: guest and guest2"):
        load(KIND, "twice")
    with pytest.raises(InputFileError, match=r"dish 'gone' \(no_such_module, entry point of test\.dishes\)"):
        load(KIND, "gone")


class Params(NamedTuple):
    gain: Annotated[float, Bounds(0.0, 10.0, "1/s")] = 1.0
    count: int = 3
    mode: Literal["a", "b"] = "a"
    word: str = "x"
    on: bool = False
    least: Annotated[int, Bounds(1)] = 1


def test_values_become_what_is_declared():
    fields = fields_of(Params, "here")
    values = converted(fields, {"gain": "1e-1", "count": 2.0, "mode": "b", "on": True}, "here", "parameter")
    assert values == {"gain": 0.1, "count": 2, "mode": "b", "word": "x", "on": True, "least": 1}
    assert [type(value) for value in values.values()] == [float, int, str, str, bool, int]


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("gain", -1, "here: gain: must be a number from 0 to 10 1/s, not -1"),
        ("gain", 10.1, "here: gain: must be a number from 0 to 10 1/s, not 10.1"),
        ("gain", math.nan, "here: gain: must be a number from 0 to 10 1/s, not nan"),
        ("gain", True, "here: gain: must be a number from 0 to 10 1/s, not True"),
        ("gain", None, "here: gain: must be a number from 0 to 10 1/s, not None"),
        ("gain", 10**400, "here: gain: must be a number"),
        ("count", 2.5, "here: count: must be a whole number, not 2.5"),
        ("count", math.inf, "here: count: must be a whole number, not inf"),
        ("least", 0, "here: least: must be a whole number >= 1, not 0"),
        ("mode", "c", "here: unknown mode 'c'"),
        ("mode", ["a"], "here: unknown mode"),
        ("word", 3, "here: word: must be text, not 3"),
        ("on", "yes", "here: on: must be true or false, not 'yes'"),
        ("gian", 1, "here: unknown parameter 'gian'; did you mean 'gain'?"),
    ],
)
def test_a_wrong_value_is_said_with_key_bounds_and_unit(key, value, said):
    with pytest.raises((ConfigError, UnknownNameError)) as error:
        converted(fields_of(Params, "here"), {key: value}, "here", "parameter")
    assert str(error.value).startswith(said)


def test_dataclasses_and_functions_declare_fields_too():
    @dataclass
    class Options:
        size: float = 2.0

    def make(seed, robots, radius, *, size_m: float = 4, kind: Literal["a", "b"] = "b", count=3): ...

    assert fields_of(Options, "x")["size"].default == 2.0
    fields = fields_of_function(make, 3, "x")
    assert {name: field.default for name, field in fields.items()} == {"size_m": 4.0, "kind": "b", "count": 3}
    assert about(fields["kind"]) == "one of a, b"


def test_wrong_declarations_are_said():
    class NoDefault(NamedTuple):
        a: float

    class OutOfBounds(NamedTuple):
        a: Annotated[float, Bounds(0.0, 1.0)] = 2.0

    class Odd(NamedTuple):
        a: list = []  # noqa: RUF012

    for kind, said in ((NoDefault, "has no default"), (OutOfBounds, "from 0 to 1"), (Odd, "neither a float")):
        with pytest.raises(ConfigError, match=said):
            fields_of(kind, "here")


def test_our_own_folder_is_a_folder_of_members():
    from swarmscope.tasks._contract import TASKS

    file = find(TASKS, "T1").file
    assert file == Path(sys.modules["swarmscope.tasks"].__file__).parent / "t1.py"

"""Text files of users: what is read, and what is refused with a word."""

from __future__ import annotations

import os

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from swarmscope.errors import ConfigError, InputFileError
from swarmscope.scenarios.overrides import set_key
from swarmscope.scenarios.read import load_scenario, parse_scenario
from swarmscope.texts import load_yaml, read_text, read_yaml


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: 1\nb: 2\na: 3\n", "'a' is given twice"),
        ("x: {k: 1, k: 1}\n", "'k' is given twice"),
        ("a: 1_0\n", "1_0 is 10 in YAML 1.1"),
        ("a: 1:30\n", "1:30 is 90 in YAML 1.1"),
        ("a: 1_0.5\n", "1_0.5 is 10.5 in YAML 1.1"),
        ("a: 2024-13-45\n", "is not YAML"),
        ("[" * 5000, "is not YAML"),
        ("a: [1", "is not YAML"),
        ("a: !!python/object:os.system x\n", "is not YAML"),
    ],
)
def test_yaml_that_does_not_say_what_it_seems_to_say(tmp_path, text, words):
    (tmp_path / "a.yaml").write_text(text)
    with pytest.raises(InputFileError, match=words) as error:
        read_yaml(tmp_path / "a.yaml")
    assert "a.yaml" in str(error.value)


def test_yaml_that_is_as_it_seems():
    text = "a: [1, 2.5, 1e3, .inf, -7, 0x1F]\nb: &b {k: 1}\nc: {<<: *b, k: 2}\nd: '1_0'\ne: yes\n"
    assert load_yaml(text) == yaml.safe_load(text)


PLAIN = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text()


@given(st.recursive(PLAIN, st.lists, max_leaves=9))
def test_what_is_written_is_read_back(value):
    text = yaml.safe_dump({"key": value})
    assert load_yaml(text) == yaml.safe_load(text)


def test_only_regular_files_of_bounded_size_are_read(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    (tmp_path / "large").write_text("x" * 100)
    (tmp_path / "bytes").write_bytes(b"\xff\xfe\xfa")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    for name, words in (
        ("pipe", "is no regular file"),
        ("folder", "is a folder"),
        ("nothing", "No such file"),
        ("bytes", "is not text"),
        ("loop", "cannot be read"),
        ("a\0b", "cannot be read"),
    ):
        with pytest.raises(InputFileError, match=words):
            read_text(tmp_path / name)
    with pytest.raises(InputFileError, match="is no regular file"):
        read_text(tmp_path.__class__("/dev/zero"))
    with pytest.raises(InputFileError, match="is larger than"):
        read_text(tmp_path / "large", 50)
    (tmp_path / "marked").write_bytes(b"\xef\xbb\xbfa: 1\n")
    assert read_yaml(tmp_path / "marked") == {"a": 1}


@pytest.mark.parametrize(
    "values", [{"robots": True}, {"robots": "3"}, {"seed": "1"}, {"limit_s": "9"}, {"robot": {"radius_m": True}}]
)
def test_a_scenario_takes_numbers_only_where_it_wants_numbers(values):
    key = next(iter(values))
    with pytest.raises(ConfigError, match=f"test: {key}.*must be a number"):
        parse_scenario({"task": {"name": "T1"}} | values, "test")


def test_a_pipe_as_scenario_or_map_does_not_wait(tmp_path):
    os.mkfifo(tmp_path / "s.yaml")
    os.mkfifo(tmp_path / "m.png")
    with pytest.raises(InputFileError, match="no regular file"):
        load_scenario(tmp_path / "s.yaml")
    from swarmscope.sim.maps import load_map

    with pytest.raises(InputFileError, match="no regular file"):
        load_map(tmp_path / "m.png", 0.1)


def test_changes_on_the_command_line_are_as_strict():
    values = {}
    with pytest.raises(ConfigError, match="--set seed=1_0: the value is not valid YAML: 1_0 is 10"):
        set_key(values, "seed=1_0")
    set_key(values, "a.b=1e-3")
    assert values == {"a": {"b": 1e-3}}

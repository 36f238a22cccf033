import pytest

from swarmscope.errors import ConfigError, InputFileError, UnknownNameError
from swarmscope.experiments.seeds import SEED_FILE, read_seed_file, seed_set, seed_sets


def test_the_published_sets():
    assert seed_set("evaluation") == list(range(100))
    assert seed_set("paper-size") == list(range(20))
    assert seed_set("tuning") == list(range(1000, 1060))
    assert seed_set("check") == list(range(1100, 1300))
    assert seed_set("playground") == list(range(2000, 2009))
    assert seed_set("giwt-evaluation") == list(range(30000, 30500))
    assert seed_set("giwt-tuning") == list(range(31000, 31200))
    assert all(len(one.purpose) > 10 for one in seed_sets().values())


def test_what_is_tuned_on_is_never_reported():
    sets = {name: set(one.seeds) for name, one in seed_sets().items()}
    assert sets.pop("paper-size") <= sets["evaluation"]
    assert len(set.union(*sets.values())) == sum(map(len, sets.values()))


@pytest.mark.parametrize(
    ("text", "seeds"),
    [
        ("7", [7]),
        ("3-6", [3, 4, 5, 6]),
        ("3 - 4", [3, 4]),
        ("5-5", [5]),
        ("9,1, 4", [9, 1, 4]),
        ("2-4,3-5,2", [2, 3, 4, 5]),
        ("playground,1,8-9", [*range(2000, 2009), 1, 8, 9]),
        ("2147483647", [2147483647]),
    ],
)
def test_lists_written_by_hand(text, seeds):
    assert seed_set(text) == seeds


def test_a_list_can_be_changed_without_changing_the_set():
    seed_set("tuning").clear()
    assert seed_set("tuning")[0] == 1000


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "nothing between two commas"),
        ("1,,2", "nothing between two commas"),
        ("tuning,", "nothing between two commas"),
        ("-3", "'-3' is not a seed"),
        ("1.5", "not a seed"),
        ("3-", "not a seed"),
        ("1-2-3", "not a seed"),
        ("3x", "not a seed"),
        ("9-3", "ends before it begins"),
        ("2147483648", "the largest seed is 2147483647"),
        ("0-100000", "more than 100000 seeds"),
    ],
)
def test_wrong_lists_say_why(text, why):
    with pytest.raises(ConfigError, match=why):
        seed_set(text)


@pytest.mark.parametrize("text", ["tunning", "1-3,tunning", "Tuning"])
def test_an_unknown_set_names_the_nearest(text):
    with pytest.raises(UnknownNameError, match=r"unknown set of seeds '[tT]un+ing'; did you mean 'tuning'"):
        seed_set(text)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("version: 2\nsets: {}\n", "has version 2"),
        ("- 1\n", "not a file of seeds"),
        ("version: 1\nsets: {a: {seeds: 1-2}}\n", "not a file of seeds"),
        ("version: [\n", "is not YAML"),
    ],
)
def test_a_wrong_file_is_named(tmp_path, text, why):
    path = tmp_path / "seeds.yaml"
    path.write_text(text)
    with pytest.raises(InputFileError, match=why):
        read_seed_file(path)
    with pytest.raises(InputFileError, match="cannot be read"):
        read_seed_file(tmp_path / "none.yaml")


def test_the_file_stands_among_the_packages_data():
    assert SEED_FILE.parts[-3:] == ("swarmscope", "data", "seeds.yaml")

"""Maps of the unit disk: those of the report, files, random ones, and what is refused."""

import numpy as np
import pytest

from swarmscope.disk import check, maps, random_maps, rules, runs
from swarmscope.disk.find_map import find_map
from swarmscope.errors import ConfigError, InputFileError, UnknownNameError, UnsolvableWorldError


def test_the_five_maps_of_the_report():
    assert [len(one.obstacles) for one in maps.REPORT_MAPS.values()] == [3, 5, 2, 1, 5]
    assert find_map("crevice", rules.Rules()).as_dicts()[1] == {"center": (0.5, -0.22), "radius": 0.2}


def test_unknown_names_are_told():
    with pytest.raises(UnknownNameError, match="did you mean 'crevice'"):
        find_map("crevise", rules.Rules())
    with pytest.raises(ConfigError, match="whole number"):
        find_map("random:x", rules.Rules())


def test_a_map_is_read_from_a_file(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("obstacles:\n  - {center: [0.1, 0.2], radius: 0.05}\n")
    assert find_map(str(file), rules.Rules()).obstacles.tolist() == [[0.1, 0.2, 0.05]]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "has to hold 'obstacles'"),
        ("obstacles: 3", "a list"),
        ("obstacles: [{center: [0], radius: 1}]", "two numbers"),
        ("obstacles: [{center: [0, .nan], radius: 1}]", "finite"),
        ("obstacles: [{center: [0, 0], radius: -1}]", "above 0"),
        ("obstacles: [{center: [1.0e+200, 0], radius: 1}]", "the disk has radius 1"),
        ("obstacles: [{center: [0, 0]}]", "obstacles.0. has to hold"),
        ("obstacles: [", "is not YAML"),
        ("discs: []", "nothing else"),
        ("obstacles: 2026-13-45", "is not YAML .month"),
        (f"obstacles: {'9' * 5000}", "is not YAML"),
        ("[" * 3000, "is not YAML"),
        ("obstacles: [{center: '12', radius: 0.1}]", "two numbers"),
        (f"obstacles: [{{center: [0, 0], radius: {'9' * 400}}}]", "finite"),
    ],
)
def test_files_that_are_no_maps_are_refused(tmp_path, text, why):
    file = tmp_path / "bad.yaml"
    file.write_text(text)
    with pytest.raises(InputFileError, match=why):
        maps.read_map(file)


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(InputFileError, match="No such file"):
        maps.read_map(tmp_path / "none.yaml")


def problem(*obstacles, **changes):
    one = maps.DiskMap("test", np.array(obstacles, dtype=float).reshape(-1, 3))
    return runs.problem(rules.Rules(**changes), [one], [(0, 1, 2, 3, 4)])


def test_obstacles_on_starts_and_goals_are_refused():
    with pytest.raises(UnsolvableWorldError, match=r"robot 0 would touch obstacle 0 .* at its start"):
        check.check(problem((0.9, 0.0, 0.1)))
    with pytest.raises(UnsolvableWorldError, match=r"robot 0 would touch obstacle 0 .* at its goal"):
        check.check(problem((-0.9, 0.0, 0.1)))


def test_a_passage_just_too_narrow_is_infeasible_and_one_just_wide_enough_is_not():
    wall = [(x, 0.0, 0.06) for x in np.arange(0.161, 0.85, 0.1)] + [
        (-x, 0.0, 0.06) for x in np.arange(0.161, 0.85, 0.1)
    ]
    start, goal = rules.starts(5)[2:3], rules.goal_places(5)[2:3]
    rim = [(s * 0.93, 0.0, 0.06) for s in (1, -1)]
    discs = np.array(wall + rim)
    assert check.first_fault(discs, 0.100, start, goal) == ""
    assert "infeasible: robot 0 of radius 0.102 has no way" in check.first_fault(discs, 0.102, start, goal)


def test_random_maps_are_the_same_for_the_same_seed_and_leave_a_way():
    for n in (5, 10):
        one, again = (random_maps.random_map(20_003, rules.scaled(n)) for _ in range(2))
        assert one.map.obstacles.tobytes() == again.map.obstacles.tobytes() and one.permutation == again.permutation
        assert random_maps.random_map(20_004, rules.scaled(n)).map.obstacles.tobytes() != one.map.obstacles.tobytes()
        of = runs.Problem(rules.scaled(n), (one.map,), np.zeros(1, dtype=np.int64), np.array([one.permutation]))
        check.check(of)


def test_random_maps_have_traps_and_both_kinds_of_passages():
    found = " ".join(random_maps.random_map(seed, rules.scaled(5)).map.about for seed in range(20_000, 20_040))
    assert all(words in found for words in ("U-shaped trap", "just wider", "just narrower", "loose discs"))

"""Starts and goals on a map: given, drawn, or both, in the map's coordinates; and what is refused with which remedy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from PIL import Image

from helpers import run_scenario
from swarmscope.errors import ConfigError, InputFileError, SwarmscopeError, UnsolvableWorldError
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import load_scenario, parse_scenario
from swarmscope.sim.maps import save_map
from swarmscope.sim.world import grid_from_solid

YAW = 1.56


def two_rooms():
    """12 x 8 m: two rooms, a door of 1.2 m between them."""
    solid = np.zeros((80, 120), np.uint8)
    solid[[0, -1]] = 1
    solid[:, [0, -1]] = 1
    solid[:34, 60] = solid[46:, 60] = 1
    return solid


@pytest.fixture
def hall(tmp_path):
    save_map(grid_from_solid(two_rooms(), 0.1, (-6.0, -4.0)), tmp_path / "hall.yaml")
    return tmp_path / "hall.yaml"


def setup_of(file, **more):
    values = {"map": {"file": str(file), **more.pop("map", {})}, **more}
    return make_setup(parse_scenario(values, "test"))


def test_robots_start_and_go_where_they_are_told(hall):
    starts, goals = [[-4.0, -2.0], [4.0, 2.0, 0.5]], [[4.0, -2.0], [-4.0, 2.0]]
    setup = setup_of(hall, map={"starts": starts, "goals": goals})
    assert setup.starts[0] == pytest.approx([-4.0, -2.0, 0.0])  # looks at its goal
    assert setup.starts[1] == pytest.approx([4.0, 2.0, 0.5])
    assert setup.goals == pytest.approx(np.array(goals))


def test_what_is_not_given_is_drawn_apart_from_what_is(hall):
    places = {"starts": [[-4.0, -2.0], None, [0.5, 0.0]], "goals": [None, [4.0, -2.0]]}
    setup = setup_of(hall, map=places, robots=8, seed=5)
    assert setup.starts[[0, 2], :2] == pytest.approx(np.array([[-4.0, -2.0], [0.5, 0.0]]))
    assert setup.goals[1] == pytest.approx([4.0, -2.0])
    for points in (setup.starts[:, :2], setup.goals):
        gaps = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
        assert gaps[~np.eye(8, dtype=bool)].min() >= 0.6
    ways = np.hypot(*(setup.goals - setup.starts[:, :2]).T)
    assert (ways > 1.0).all()
    again = setup_of(hall, map=places, robots=8, seed=5)
    assert again.starts.tobytes() == setup.starts.tobytes()


def test_as_many_robots_as_are_listed_unless_somebody_says_how_many(hall):
    starts = [[-4.0, -2.0], [-4.0, 0.0]]
    assert len(setup_of(hall, map={"starts": starts}).starts) == 2
    assert len(setup_of(hall, map={"starts": starts}, robots=5).starts) == 5
    assert len(setup_of(hall).starts) == 15


def test_how_far_goals_are_scales_with_the_map(hall):
    """Free for a robot's centre are 11.4 m: two fifths; at least 20 m make it 8 m."""
    for seed in range(5):
        setup = setup_of(hall, seed=seed, robots=4)
        assert np.hypot(*(setup.goals - setup.starts[:, :2]).T).min() > 2.0
    with pytest.raises(UnsolvableWorldError, match=r"30 m from its start: lower map\.min_distance_m"):
        setup_of(hall, map={"min_distance_m": 30.0})


@pytest.mark.parametrize(
    ("places", "more", "message"),
    [
        ({"starts": [[9.0, 0.0]]}, {}, r"starts\[0\]: \(9, 0\) is off the map, which covers \[-6, 6\] x \[-4, 4\] m"),
        ({"starts": [[-4, 0]], "goals": [[1e9, 0]]}, {}, r"map\.goals\.0"),
        ({"goals": [[4.0, 0.0], [0.0, 3.0]]}, {}, r"map\.goals\[1\]: \(0, 3\) is 0\.000 m from something solid"),
        ({"starts": [[-4, 0]] * 3}, {"robots": 2}, "3 are given for 2 robots: raise 'robots'"),
        ({"starts": [[-4, 0], [-4, 0.1]]}, {}, "robots 0 and 1: their starts are 0.100 m apart"),
        ({"starts": [[-4, 0, 0, 0]]}, {}, r"map\.starts\.0"),
        ({"trips": "a.scen", "starts": [[-4, 0]]}, {}, "either trips, or starts and goals"),
        ({"resolution_m": 0.1}, {}, "says it itself"),
    ],
)
def test_what_cannot_be_is_refused_with_its_key(hall, places, more, message):
    with pytest.raises(SwarmscopeError, match=message):
        setup_of(hall, map=places, **more)


def test_a_goal_behind_a_closed_door_is_refused(tmp_path):
    solid = two_rooms()
    solid[:, 60] = 1
    save_map(grid_from_solid(solid, 0.1, (-6.0, -4.0)), tmp_path / "shut.yaml")
    with pytest.raises(UnsolvableWorldError, match="robot 0: no way from its start to its goal"):
        setup_of(tmp_path / "shut.yaml", map={"starts": [[-4.0, 0.0]], "goals": [[4.0, 0.0]]})


def turned(x, y, yaw=0.0):
    """A pose of the hall, its map turned round its origin."""
    c, s = math.cos(YAW), math.sin(YAW)
    dx, dy = x + 6.0, y + 4.0
    return [-6.0 + c * dx - s * dy, -4.0 + s * dx + c * dy, yaw + YAW]


def test_a_turned_map_is_the_same_building(tmp_path, hall):
    """Starts and goals turn with it; robots end up where they would, and the ways are as long."""
    save_map(grid_from_solid(two_rooms(), 0.1, (-6.0, -4.0), YAW), tmp_path / "turned.yaml")
    starts, goals = [[-4.0, -2.0, 0.3], [4.0, 2.0, 2.0]], [[4.0, -2.0], [-4.0, 2.0]]
    straight = {"map": {"file": str(hall), "starts": starts, "goals": goals}, "limit_s": 60.0}
    across = {"file": str(tmp_path / "turned.yaml")}
    across |= {"starts": [turned(*start) for start in starts], "goals": [turned(*goal)[:2] for goal in goals]}
    one, other = run_scenario(straight), run_scenario(straight | {"map": across})
    assert one.robots["arrived"].all() and other.robots["arrived"].all()
    assert other.robots["length"] == pytest.approx(one.robots["length"], rel=0.02)
    assert other.robots["arrival_s"] == pytest.approx(one.robots["arrival_s"], abs=1.0)


def write_trips(folder, trips):
    """Write a.map, a hall of 12 x 8 cells with walls round it, and a.scen."""
    rows = ["@" * 12] + ["@" + "." * 10 + "@"] * 6 + ["@" * 12]
    (folder / "a.map").write_text("type octile\nheight 8\nwidth 12\nmap\n" + "\n".join(rows) + "\n")
    lines = [f"0\ta.map\t12\t8\t{x}\t{y}\t{p}\t{q}\t9" for x, y, p, q in trips]
    (folder / "a.scen").write_text("version 1\n" + "\n".join(lines) + "\n")


def test_trips_of_a_moving_ai_map(tmp_path):
    write_trips(tmp_path, [(1, 1, 9, 6), (2, 3, 10, 1), (10, 6, 1, 6)])
    place = "map: {file: a.map, resolution_m: 0.5, trips: a.scen, first_trip: 1}\nrobots: 2\n"
    (tmp_path / "s.yaml").write_text(place)
    setup = make_setup(load_scenario(tmp_path / "s.yaml"))
    assert setup.starts[:, :2] == pytest.approx(np.array([[1.25, 2.25], [5.25, 0.75]]))
    assert setup.goals == pytest.approx(np.array([[5.25, 3.25], [0.75, 0.75]]))
    (tmp_path / "s.yaml").write_text(place.replace("robots: 2", ""))
    assert load_scenario(tmp_path / "s.yaml").robots == 2  # the file has no more
    for old, new, message in (
        ("robots: 2", "robots: 3", "3 robots take trips 1 to 3, and there are 3: ask for fewer 'robots'"),
        ("resolution_m: 0.5, ", "", r"map\.resolution_m: .*a\.map does not say how large"),
    ):
        (tmp_path / "s.yaml").write_text(place.replace(old, new))
        with pytest.raises(ConfigError, match=message):
            make_setup(load_scenario(tmp_path / "s.yaml"))


def test_a_trip_that_ends_in_a_wall_is_named_as_a_trip(tmp_path):
    write_trips(tmp_path, [(1, 1, 9, 6), (2, 3, 10, 1), (10, 6, 0, 6)])
    (tmp_path / "s.yaml").write_text("map: {file: a.map, resolution_m: 0.5, trips: a.scen, first_trip: 1}\n")
    with pytest.raises(ConfigError, match=r"map\.trips: goal of trip 2: "):
        make_setup(load_scenario(tmp_path / "s.yaml"))


def test_a_place_has_as_many_robots_as_starts():
    place = {"world": {"obstacles": [], "bounds": [-4, -4, 4, 4]}, "starts": [[0, 0, 0]], "goals": [[3, 0]]}
    assert parse_scenario({"place": place}, "test").robots == 1


def test_a_picture_drawn_in_a_paint_program(tmp_path):
    Image.fromarray(np.where(two_rooms()[::-1], 0, 255).astype(np.uint8)).save(tmp_path / "drawn.png")
    setup = setup_of(tmp_path / "drawn.png", map={"resolution_m": 0.1, "starts": [[2.0, 2.0]], "goals": [[10.0, 6.0]]})
    assert setup.world.bounds == pytest.approx((0.0, 0.0, 12.0, 8.0))


def test_a_maze_of_orion(tmp_path):
    cells = np.full((2, 8, 12), 127, np.uint8)
    cells[:, 1:-1, 1:-1] = 255
    cells[1, 1, 1], cells[1, 6, 9], cells[1, 3, 2], cells[1, 1, 10] = 208, 50, 209, 51
    np.savez(tmp_path / "mazes.npz", map=np.array([3, 5]), true=cells, prior=cells)
    place = {"resolution_m": 1.0, "number": 5}
    setup = setup_of(tmp_path / "mazes.npz", map=place, robots=2)
    assert setup.starts[:, :2] == pytest.approx(np.array([[1.5, 6.5], [2.5, 4.5]]))
    assert setup.goals == pytest.approx(np.array([[9.5, 1.5], [10.5, 6.5]]))
    alone = {"map": place | {"file": str(tmp_path / "mazes.npz")}}
    assert parse_scenario(alone, "test").robots == 2
    assert len(setup_of(tmp_path / "mazes.npz", map=place | {"number": 3}, robots=4).starts) == 4  # none in it: drawn
    for changes, robots, message in (
        ({"number": 4}, 2, r"map\.number: .*mazes\.npz has no maze 4; it has 2: 3, 5"),
        ({"number": None}, 2, r"map\.number: .* holds many mazes"),
        ({}, 3, "3 robots take trips 0 to 2, and there are 2: ask for fewer 'robots'"),
    ):
        with pytest.raises(ConfigError, match=message):
            setup_of(tmp_path / "mazes.npz", map=place | changes, robots=robots)


def test_files_in_which_there_is_nowhere_to_be_are_refused_with_why(tmp_path):
    """Black ink on nothing, as layers of drawings are saved; and BARN's worlds, which have a command of their own."""
    ink = np.zeros((80, 120, 4), np.uint8)
    ink[..., 3] = 255 * two_rooms()
    Image.fromarray(ink).save(tmp_path / "ink.png")
    with pytest.raises(UnsolvableWorldError, match="dark, transparent or unknown is not free"):
        setup_of(tmp_path / "ink.png", map={"resolution_m": 0.1})
    np.savez(tmp_path / "barn.npz", centers_m=np.zeros((3, 2)), world=np.arange(1))
    with pytest.raises(InputFileError, match=r"no file of ORION's mazes.*worlds of BARN are for 'swarmscope barn'"):
        setup_of(tmp_path / "barn.npz", map={"resolution_m": 1.0, "number": 0})


def test_a_map_within_a_written_out_world_is_refused_with_the_remedy():
    with pytest.raises(ConfigError, match="instead of 'place'"):
        parse_scenario({"place": {"world": {"map": "a.yaml", "bounds": [0, 0, 1, 1]}, "starts": [], "goals": []}}, "x")

"""The buildings in which memory counts: hospital, warehouse, rubble, maze, and the trips through them."""

import numpy as np
import pytest
from scipy import ndimage

from swarmscope.errors import ConfigError
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_setting
from swarmscope.sim.world import Door, Polygon, compile_world, solid_from_grid
from swarmscope.tasks import check_setup, load_task
from swarmscope.tasks._occupancy import rasterise
from swarmscope.tasks._trips import places_in

BUILDINGS = ("hospital", "warehouse", "rubble", "maze")


def boxes_of(setup):
    """Corners (x0, y0, x1, y1) of everything that is a box along the axes."""
    shapes = [np.array(o.points) for o in setup.world.obstacles if isinstance(o, Polygon)]
    return np.array([[*p.min(axis=0), *p.max(axis=0)] for p in shapes])


@pytest.mark.parametrize("name", BUILDINGS)
@pytest.mark.parametrize("depart", ["at_once", "staggered", "convoy"])
@pytest.mark.parametrize("ways", ["one", "two", "any"])
def test_every_kind_of_trip_can_be_made(name, depart, ways):
    setup = load_task(name).make(4, robots=15, depart=depart, ways=ways)
    check_setup(setup, 0.15)
    wanted = None if depart == "at_once" else (8.0 * np.arange(15)).tolist()
    assert (None if setup.start_s is None else setup.start_s.tolist()) == wanted


@pytest.mark.parametrize("name", BUILDINGS)
def test_a_convoy_is_a_queue_at_one_end_and_a_row_at_the_other(name):
    setup = load_task(name).make(2, robots=12, depart="convoy")
    for places in (setup.starts[:, :2], setup.goals):
        np.testing.assert_allclose(np.hypot(*np.diff(places, axis=0).T), 0.6, atol=1e-9)
        assert np.ptp(places[:, 0]) == 0.0
    x0, _, x1, _ = setup.world.bounds
    assert setup.starts[:, 0].max() < x0 + 0.2 * (x1 - x0) and setup.goals[:, 0].min() > x1 - 0.2 * (x1 - x0)


def test_two_ways_are_as_many_as_from_the_other_end():
    one, two = (load_task("warehouse").make(3, robots=14, ways=ways) for ways in ("one", "two"))
    assert np.all(one.starts[:, 0] < one.goals[:, 0])
    assert (two.starts[:, 0] < two.goals[:, 0]).sum() == 7
    ends = [np.vstack([setup.starts[:, :2], setup.goals]) for setup in (one, two)]
    assert {tuple(p) for p in ends[0]} == {tuple(p) for p in ends[1]}


def test_trips_anywhere_are_long_and_share_no_place():
    setup = load_task("hospital").make(5, robots=30)
    assert np.hypot(*(setup.goals - setup.starts[:, :2]).T).min() >= 12.0
    assert len({tuple(p) for p in np.vstack([setup.starts[:, :2], setup.goals])}) == 60
    with pytest.raises(ConfigError, match="far_m"):
        load_task("hospital").make(5, far_m=60.0)


def test_the_hospital_is_as_described():
    shut = [load_task("hospital").make(seed, more_doors=0.0, wide=0.0) for seed in range(3)]
    for setup in shut:
        # 70 rooms and two halls on a tree: 71 doors, each of two pieces of wall; 11 x 6 pillars stand beside
        pieces = boxes_of(setup)[4:]
        sides = pieces[:, 2:] - pieces[:, :2]
        walls = pieces[(sides.max(axis=1) > 0.2 + 1e-9) | (sides.min(axis=1) < 0.2 - 1e-9)]
        assert 11 * 7 + 10 * 6 + 71 == len(walls) == len(pieces) - 11 * 6
        x0, y0, x1, y1 = setup.world.bounds
        inside = (x0 + 0.7, y0 + 0.7, x1 - 0.7, y1 - 0.7)
        free = rasterise(compile_world(setup.world), 0.2, inside, 0.1)
        assert ndimage.label(free.blocked == 0)[1] == 1
    wide = [load_task("hospital").make(seed, wide=1.0) for seed in range(3)]
    assert all(np.min(boxes_of(s)[:, 2:] - boxes_of(s)[:, :2], axis=1).max() < 0.21 for s in wide)


def test_doors_and_walkers_come_when_they_are_asked_for():
    setup = load_task("hospital").make(1, swinging=0.5, walkers=6)
    doors = [o for o in setup.world.obstacles if isinstance(o, Door)]
    assert len(doors) > 10
    assert all(np.hypot(*np.diff(np.array(d.points), axis=0)[0]) == pytest.approx(1.0) for d in doors)
    assert sum(getattr(o, "moves", False) for o in setup.world.obstacles) == 6
    assert sum(getattr(o, "moves", False) for o in load_task("warehouse").make(1, walkers=3).world.obstacles) == 3


@pytest.mark.parametrize("seed", range(6))
def test_in_the_warehouse_at_least_three_aisles_of_a_block_are_open(seed):
    setup = load_task("warehouse").make(seed, closed=1.0)
    plugs = [b for b in boxes_of(setup)[4:] if b[2] - b[0] == pytest.approx(1.2)]
    assert len(plugs) == 18
    assert all(b[3] - b[1] == pytest.approx(1.6) for b in plugs)
    places = np.array([b[0] % 13.0 for b in plugs])
    assert set(places.round(2)) <= {8.8, 4.4, 0.0}


def test_most_aisles_are_closed_where_it_cannot_be_seen_from_the_front():
    made = [load_task("warehouse").make(seed, closed=1.0) for seed in range(12)]
    places = np.array([b[0] % 13.0 for s in made for b in boxes_of(s)[4:] if b[2] - b[0] == pytest.approx(1.2)])
    assert np.mean(places > 8.0) == pytest.approx(0.6, abs=0.12)


@pytest.mark.parametrize("seed", range(3))
def test_two_fifths_of_the_rubble_are_covered(seed):
    setup = load_task("rubble").make(seed)
    free = rasterise(compile_world(setup.world), 0.0, (0.0, 0.0, 24.0, 24.0), 0.1)
    assert 0.39 < free.blocked.mean() < 0.45


@pytest.mark.parametrize("seed", range(5))
def test_a_maze_is_one_piece_of_corridors_one_cell_wide(seed):
    setup = load_task("maze").make(seed, cleared=0.0)
    grid = next(o for o in setup.world.obstacles if o.type == "grid")
    free = solid_from_grid(grid) == 0
    assert (grid.width, grid.height, grid.resolution) == (31, 28, 1.5)
    assert ndimage.label(free)[1] == 1
    assert not (free[:-1, :-1] & free[1:, :-1] & free[:-1, 1:] & free[1:, 1:]).any()
    assert free[0].all() and free[:, 0].all() and free[-1].all() and free[:, -1].all()
    assert 0.3 < free.mean() < 0.6


def test_robots_that_do_not_fit_are_told_so():
    with pytest.raises(ConfigError, match="130 do not fit"):
        load_task("maze").make(0, robots=130, ways="one")


def test_when_robots_set_out_goes_into_the_run():
    values = {"task": {"name": "warehouse", "options": {"depart": "staggered", "every_s": 3.0}}, "robots": 3}
    setup = load_task("warehouse").make(0, robots=3, depart="staggered", every_s=3.0)
    assert make_setting(parse_scenario(values, "test"), setup).start_s == (0.0, 3.0, 6.0)
    later = values | {"robot": [{"start_s": 0.0}, {"start_s": 10.0}, {"start_s": 1.0}]}
    assert make_setting(parse_scenario(later, "test"), setup).start_s == (0.0, 10.0, 6.0)


def test_places_stand_about_the_middle_of_a_room():
    np.testing.assert_allclose(places_in((0.0, 0.0, 2.0, 1.0), 0.9, 0.5), [[0.55, 0.5], [1.45, 0.5]])
    np.testing.assert_allclose(places_in((0.0, 0.0, 0.6, 0.4), 0.9, 0.5), [[0.3, 0.2]])

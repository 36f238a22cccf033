"""Pictures of the unit disk: they are drawn, differ where runs differ, and are the same for the same run."""

import io

import numpy as np
import pytest
from PIL import Image

from swarmscope.disk import bounds, controllers, maps, rules, runs
from swarmscope.disk.stalls import Situation, basins
from swarmscope.disk.study import pictures


def played(name="report", map_="c0", permutation=(0, 3, 1, 4, 2), **changes):
    of = runs.problem(rules.Rules(**changes), [maps.NAMED[map_]], [permutation])
    kind, film = controllers.find(name), runs.Film(50, [])
    return of, runs.play(of, kind.create(of, kind.params), film), film


def image(png):
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def has(pixels, colour):
    wanted = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    return bool((np.abs(pixels - wanted).sum(axis=2) < 12).any())


def test_paths_of_all_robots_are_drawn_and_the_bytes_are_the_same_again():
    of, outcome, film = played()
    png = pictures.trajectories_png(of, 0, outcome, film, "report", int(bounds.bound(of)[0]))
    assert png == pictures.trajectories_png(of, 0, outcome, film, "report", int(bounds.bound(of)[0]))
    pixels = image(png)
    assert all(has(pixels, pictures.robot_colour(k)) for k in range(5))
    assert not has(pixels, pictures.CRASH)


def test_names_are_no_formulas():
    of, outcome, film = played("reactive", max_steps=60)
    odd = runs.problem(of.rules, [maps.DiskMap("$x_{$", of.maps[0].obstacles)], of.permutation)
    name = "mine $\\frac$"
    assert image(pictures.trajectories_png(odd, 0, outcome, film, name, 8000)).size
    assert image(pictures.clearance_png(odd, 0, outcome, film, name)).size
    assert image(pictures.paths_side_by_side_png(odd, 0, [(name, outcome, film)], 8000)).size
    kind = controllers.find("report")._replace(name=name)
    situation = Situation(kind, odd.maps[0], odd.rules, (0, 3, 1, 4, 2), 2, None)
    assert image(pictures.field_png(situation, basins(situation, 5, coarse=20.0), 20.0)).size


def test_a_collision_is_marked():
    of, outcome, film = played()
    outcome.status[0], outcome.involved[0] = runs.HIT_ROBOT, (1, 3)
    assert has(image(pictures.trajectories_png(of, 0, outcome, film, "report", 8000)), pictures.CRASH)


@pytest.mark.parametrize("changes", [{}, {"n": 1, "permutation": (0,), "map_": "empty"}, {"n": 1, "permutation": (0,)}])
def test_clearance_is_drawn_also_where_nothing_can_be_touched(changes):
    of, outcome, film = played(**changes)
    pixels = image(pictures.clearance_png(of, 0, outcome, film, "report"))
    assert has(pixels, "#0072b2") == (of.rules.n > 1 or changes.get("n") == 1)  # robot 0 has that colour, too
    assert pixels.shape[1] > pixels.shape[0]


def test_gaps_are_those_between_edges():
    where = np.array([[[0.0, 0.0], [0.3, 0.0]], [[0.0, 0.0], [0.0, 0.2]]])
    robots, obstacles = pictures._gaps(where, np.array([[0.0, -0.5, 0.1]]), 0.05)
    assert robots == pytest.approx([0.2, 0.1])
    assert obstacles == pytest.approx([0.35, 0.35])


def test_shortest_ways_end_at_the_goals():
    of, _, _ = played()
    for k, way in enumerate(pictures._shortest_ways(of, 0)):
        assert way[0] == pytest.approx(of.start[0, k]) and way[-1] == pytest.approx(of.goal[0, k])
        gaps = np.linalg.norm(way[:, None] - of.maps[0].obstacles[None, :, :2], axis=2) - of.maps[0].obstacles[:, 2]
        assert gaps.min() > of.rules.r - 1e-3


def test_the_field_shows_equipotentials_where_there_is_a_potential_and_circling_where_it_is():
    def picture(name, coarse):
        situation = Situation(controllers.find(name), maps.NAMED["minima"], rules.Rules(), (0, 1, 2, 4, 3), 2, None)
        pixels = image(pictures.field_png(situation, basins(situation, 25, coarse), coarse))
        green = (pixels[..., 1] > pixels[..., 0] + 40) & (pixels[..., 1] > pixels[..., 2] + 40)
        pink = (pixels[..., 0] > pixels[..., 1] + 25) & (pixels[..., 2] > pixels[..., 1] + 10)
        return green.sum(), pink.sum()

    green, pink = picture("navigation-function", 5.0)
    assert green > 4000 and pink < 1000
    green, pink = picture("report", 2.0)  # it circles in steps as short as these
    assert green < 1000 and pink > 4000


def test_several_controllers_side_by_side():
    of, outcome, film = played()
    one = image(pictures.paths_side_by_side_png(of, 0, [("a", outcome, film)], 8000))
    two = image(pictures.paths_side_by_side_png(of, 0, [("a", outcome, film), ("b", outcome, film)], 8000))
    assert two.shape[1] == pytest.approx(2 * one.shape[1], abs=2)


def test_the_repulsion_is_drawn_with_both_buffers():
    params = controllers.find("report").params
    png = pictures.repulsion_png(params)
    assert png == pictures.repulsion_png(params)
    assert all(has(image(png), pictures.ROBOTS[k]) for k in (0, 1, 2))
    assert png != pictures.repulsion_png(params._replace(obstacle_buffer=0.005))
    assert not has(image(pictures.repulsion_png(params._replace(obstacle_buffer=0.0))), pictures.ROBOTS[1])

"""Small places and maps after public reports, each as a file given to the command, and its right value: a run that ends
well, or a line that says what would."""

from __future__ import annotations

import math

import numpy as np
import pytest
import yaml
from command_line import refused, swarmscope
from PIL import Image

from helpers import circle, place_scenario, wall
from swarmscope import load_run

FLOOR = (-6, -4, 6, 4)
ROOM = wall((-5, -3), (5, -3), (5, 3), (-5, 3), (-5, -3))
IN_ROOM = (-5.2, -3.2, 5.2, 3.2)
LINE = wall((-5, 2), (5, 2))
L_SHAPE = {"type": "polygon", "points": [[0, -1], [2, -1], [2, 0], [1, 0], [1, 2], [0, 2]]}


def written(folder, values):
    """A scenario's file; scans are recorded."""
    file = folder / "scenario.yaml"
    file.write_text(yaml.safe_dump(values | {"record_scans": "yes"}))
    return file


def run_of(folder, values, *words):
    """What the command says, and the run that it made."""
    done = swarmscope("run", written(folder, values), "--no-pictures", "--out", folder / "run", *words)
    assert done.exit_code == 0, done.stderr
    return done.stdout, load_run(folder / "run")


def arrives(run):
    """All arrive, and nobody touches anything."""
    assert run.metrics["arrival_rate"] == 1.0
    untouched(run)


def untouched(run):
    assert run.metrics["collisions"] == run.metrics.get("walked_into", 0) == 0
    assert run.metrics["min_clearance_m"] > 0.0


def crossing(*obstacles, **more):
    """One robot from one side of the floor to the other."""
    return place_scenario([(-4, 0, 0)], [(4, 0)], obstacles, FLOOR, **more)


def parked_in_a_door(*walls):
    """Robot 0 stands in the door of a wall, robot 1 wants to the other side."""
    upper = wall((0, 0.35), (0, 3))
    return place_scenario([(0, 0, 0), (-3, 0.5, 0)], [(0, 0), (3, 0)], [ROOM, *walls, upper], IN_ROOM)


@pytest.mark.parametrize(
    ("goals", "words"),
    [
        ([(-3, 1.84), (-1, 1.82), (1, 1.8), (3, 1.75)], "robot 0: its goal (-3.000, 1.840)"),
        ([(-1, 1.84)], "robot 0: its goal (-1.000, 1.840)"),
        ([(-1, 1.82)], "robot 0 cannot arrive: its goal (-1.000, 1.820) is 0.170 m from an obstacle"),
    ],
)
def test_goals_near_a_wall_are_refused_with_the_distance_that_would_do(tmp_path, goals, words):
    starts = [(x, -1, 1.5) for x, _ in goals]
    said = refused("run", written(tmp_path, place_scenario(starts, goals, [LINE], FLOOR)))
    assert words in said and "0.18 m would do" in said and f"{tmp_path / 'scenario.yaml'}: " in said
    (tmp_path / "there").mkdir()
    _, run = run_of(tmp_path / "there", place_scenario(starts, [(x, 1.81) for x, _ in goals], [LINE], FLOOR))
    arrives(run)


def test_who_stands_in_the_only_door_is_named(tmp_path):
    lower = wall((0, -3), (0, -0.35))
    said, run = run_of(tmp_path, parked_in_a_door(lower), "--limit", 100)
    untouched(run)
    assert run.metrics["arrival_rate"] == 0.5
    assert "robot 1 did not arrive: " in said and "robot 0 stands in its only way" in said


def test_past_who_stands_in_one_of_two_doors(tmp_path):
    lower = wall((0, -3), (0, -2.4)), wall((0, -1.7), (0, -0.35))
    arrives(run_of(tmp_path, parked_in_a_door(*lower) | {"limit_s": 300.0})[1])


def test_two_radii_meet_head_on(tmp_path):
    values = place_scenario([(-4, 0, 0), (4, 0, math.pi)], [(4, 0), (-4, 0)], bounds=FLOOR)
    _, run = run_of(tmp_path, values | {"robot": [{"radius_m": 0.15}, {"radius_m": 0.35}]})
    arrives(run)
    gaps = np.hypot(run.trace.x_m[:, 0] - run.trace.x_m[:, 1], run.trace.y_m[:, 0] - run.trace.y_m[:, 1])
    assert 0.5 < gaps.min() < 1.5


def test_a_heading_at_the_goal(tmp_path):
    _, run = run_of(tmp_path, place_scenario([(-4, 0, 0)], [(4, 0, 1.57)], bounds=FLOOR))
    arrives(run)
    assert run.trace.yaw_rad[-1, 0] == pytest.approx(1.57, abs=math.radians(2.0))


def test_a_disc_that_moves_is_seen_and_not_touched(tmp_path):
    disc = circle(0, -3, 0.3) | {"velocity": [0, 0.5]}
    _, run = run_of(tmp_path, crossing(disc))
    arrives(run)
    assert run.trace.disc_xy_m[:, 0, 1] == pytest.approx(-3.0 + 0.5 * run.trace.t_s, abs=1e-6)
    assert (run.trace.scan_u8[:, 0] < 255).any(axis=1).any()  # there is nothing else to see
    still = circle(0, -3, 0.3)
    assert not (run_of(tmp_path, crossing(still), "--force")[1].trace.scan_u8[:, 0] < 100).any()


def test_the_bay_of_a_polygon_is_free_and_its_body_is_not(tmp_path):
    arrives(run_of(tmp_path, crossing(L_SHAPE))[1])
    into = place_scenario([(-4, 0, 0)], [(1.5, 0.6)], [L_SHAPE], FLOOR)
    arrives(run_of(tmp_path, into, "--force")[1])
    for goal in ([0.5, 1.0], [1.0, -0.5]):
        into["place"]["goals"] = [goal]
        assert "robot 0: its goal" in refused("run", written(tmp_path, into))


def test_a_narrow_field_of_view(tmp_path):
    """57 degrees, as depth cameras have."""
    lidar = {"beams": 640, "fov_deg": 57.0, "range_m": 4.0, "range_min_m": 0.1}
    arrives(run_of(tmp_path, crossing(circle(0, 0.1, 0.3), lidar=lidar))[1])


def test_a_row_of_goals_is_refused_with_the_least_spacing(tmp_path):
    starts = [(-4, -2.0 + 0.8 * k, 0) for k in range(6)]
    rows = {apart: [(3, (k - 2.5) * apart) for k in range(6)] for apart in (0.32, 0.36)}
    said = refused("run", written(tmp_path, place_scenario(starts, rows[0.32], bounds=FLOOR)))
    assert "robots 0 and 1 cannot both arrive for certain: their goals are 0.320 m apart" in said
    assert "0.36 m would do" in said
    arrives(run_of(tmp_path, place_scenario(starts, rows[0.36], bounds=FLOOR) | {"limit_s": 200.0})[1])


@pytest.mark.parametrize(
    ("start", "goal", "end", "bounds"),
    [((-3, 0, 0), (6, 0), (4, 0), (-6, -4, 8, 4)), ((0, -3, 1.5707963), (0, 6), (0, 4), (-4, -6, 4, 8))],
)
def test_walls_seen_end_on(tmp_path, start, goal, end, bounds):
    arrives(run_of(tmp_path, place_scenario([start], [goal], [wall((0, 0), end)], bounds))[1])


def test_a_door_too_narrow_for_the_shortest_range_is_refused_with_the_narrowest(tmp_path):
    def door(half):
        posts = [[[-0.05, a], [0.05, a], [0.05, b], [-0.05, b]] for a, b in ((-3, -half), (half, 3))]
        posts = [{"type": "polygon", "points": points} for points in posts]
        lidar = {"beams": 360, "range_m": 4.0, "range_min_m": 0.3}
        return place_scenario([(-3, 1.0, 0)], [(3, -1.0)], [*posts, ROOM], IN_ROOM, lidar=lidar)

    said = refused("run", written(tmp_path, door(0.3)))
    assert "lidar.range_min_m: robot 0 has no way from its start to its goal" in said and "0.65 m wide" in said
    arrives(run_of(tmp_path, door(0.325))[1])


def drawn(folder, cells, name="map.pgm", **more):
    """A map of map_server's: rows from the top, grey or RGBA."""
    Image.fromarray(cells).save(folder / name)
    about = {"image": name, "resolution": 0.1, "origin": [-8.0, -6.0, 0.0], "negate": 0}
    about |= {"occupied_thresh": 0.65, "free_thresh": 0.196} | more
    (folder / "map.yaml").write_text(yaml.safe_dump(about))
    return folder / "map.yaml"


def hall():
    """16 x 12 m, a wall in its middle with doors above and below."""
    cells = np.zeros((120, 160), np.uint8)
    cells[2:118, 2:158] = 254
    cells[20:100, 78:80] = 0
    return cells


def on_map(file, *words, robots=3):
    """The run of some robots on a map."""
    out = file.parent / "run"
    done = swarmscope("run", "--map", file, "--no-pictures", "--robots", robots, "--out", out, *words)
    assert done.exit_code == 0, done.stderr
    run = load_run(out)
    untouched(run)
    return run


def inside(run, x0, y0, x1, y1):
    x, y = run.trace.x_m, run.trace.y_m
    return x.min() > x0 and x.max() < x1 and y.min() > y0 and y.max() < y1


def test_what_a_paint_program_erased_is_no_place_to_be(tmp_path):
    cells = np.dstack([hall()] * 3 + [np.full((120, 160), 255, np.uint8)])
    cells[2:118, 80:158] = 255, 255, 255, 0
    file = drawn(tmp_path, cells, "map.png")
    run = on_map(file)
    arrives(run)
    assert inside(run, -7.8, -5.8, 0.0, 5.8)
    assert "goals[0]: (4, 0) is 0.000 m from something solid" in refused("run", "--map", file, "--goal", "4,0")


def test_a_map_that_is_turned(tmp_path):
    """The hall by 1.56: what was 4 m right of its corner is 4 m above it."""
    file = drawn(tmp_path, hall(), origin=[-8.0, -6.0, 1.56], free_thresh=0.25)
    run = on_map(file, "--start=-9,-2", "--goal=-9,6", "--start=-16,-4", "--goal=-12,-2", robots=2)
    arrives(run)
    assert run.trace.x_m[0] == pytest.approx([-9.0, -16.0]) and run.trace.y_m[0] == pytest.approx([-2.0, -4.0])
    assert "is off the map" in refused("run", "--map", file, "--start", "4,0")


def test_a_picture_in_the_users_folder(tmp_path, monkeypatch):
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.setenv("HOME", str(home))
    file = drawn(tmp_path, hall(), free_thresh=0.25)
    file.write_text(file.read_text().replace("map.pgm", "~/fc_map.pgm"))
    said = refused("run", "--map", file)
    assert f"{home / 'fc_map.pgm'}: cannot be read (No such file" in said and str(file) in said
    (tmp_path / "map.pgm").rename(home / "fc_map.pgm")
    arrives(on_map(file))


def test_a_map_in_mode_scale(tmp_path):
    arrives(on_map(drawn(tmp_path, hall(), mode="scale")))


@pytest.mark.parametrize(("width", "length"), [(160, 120), (100, 108)])
def test_nobody_leaves_a_map_that_is_free_up_to_its_edge(tmp_path, width, length):
    """A wall that parts the map, and one that leaves 1.2 m: whoever could go round outside would."""
    cells = np.full((120, width), 254, np.uint8)
    middle = width // 2
    cells[:length, middle - 2 : middle] = 0
    run = on_map(drawn(tmp_path, cells), robots=4)
    assert inside(run, -7.85, -5.85, -8.15 + 0.1 * width, 5.85)


def test_starts_and_goals_on_a_map_of_ones_own(tmp_path):
    """Nine pillars in a room of the size of the usual first robot's world, in map_saver's colours."""
    cells = np.full((384, 384), 205, np.uint8)
    rows, columns = np.mgrid[:384, :384]
    x, y = -10.0 + 0.05 * (columns + 0.5), -10.0 + 0.05 * (383.5 - rows)
    cells[np.hypot(x, y) < 2.6] = 0
    cells[np.hypot(x, y) < 2.5] = 254
    for middle in [(1.1 * i, 1.1 * j) for i in (-1, 0, 1) for j in (-1, 0, 1)]:
        cells[np.hypot(x - middle[0], y - middle[1]) < 0.15] = 0
    drawn(tmp_path, cells, resolution=0.05, origin=[-10.0, -10.0, 0.0])
    places = "starts: [[-2.0, -0.5, 0.0], [2.0, 0.5, 3.14]], goals: [[1.5, 0.5], [-1.5, -0.5]]"
    (tmp_path / "s.yaml").write_text(f"map: {{file: map.yaml, {places}}}\nrobots: 2\n")
    done = swarmscope("run", tmp_path / "s.yaml", "--no-pictures", "--out", tmp_path / "run")
    assert done.exit_code == 0, done.stderr
    run = load_run(tmp_path / "run")
    arrives(run)
    assert run.trace.x_m[0] == pytest.approx([-2.0, 2.0]) and run.trace.yaw_rad[0] == pytest.approx([0.0, 3.14])
    assert np.hypot(run.trace.x_m[-1] - [1.5, -1.5], run.trace.y_m[-1] - [0.5, -0.5]).max() < 0.1
    other = "world: {map: map.yaml, bounds: [-10, -10, 9.2, 9.2]}, starts: [[-2.0, -0.5, 0.0]], goals: [[1.5, 0.5]]"
    (tmp_path / "s.yaml").write_text(f"place: {{{other}}}\nrobots: 1\n")
    assert "'map: {file, starts, goals}' instead of 'place'" in refused("run", tmp_path / "s.yaml")

"""The path picture and what its reader refuses."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_run import make_fake_run
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from swarmscope.errors import InputFileError
from swarmscope.sim.world import Circle, grid_from_solid
from swarmscope.viewing.pictures import draw_obstacles, extent_of, write_picture
from swarmscope.viewing.run_data import (
    WorldFile,
    crash_ticks,
    decision_ticks,
    headline,
    load_run,
    shown_bounds,
    summary_rows,
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return make_fake_run(tmp_path / "run", crashed=4)


def rewrite_arrays(folder: Path, **changes: np.ndarray) -> None:
    with np.load(folder / "trajectory.npz") as archive:
        arrays = dict(archive)
    np.savez_compressed(folder / "trajectory.npz", **(arrays | changes))


def test_picture_shows_obstacles_paths_and_the_crash(folder: Path) -> None:
    path = write_picture(folder)
    assert path == folder / "paths.png"
    picture = Image.open(path)
    pixels = np.asarray(picture.convert("RGB")).reshape(-1, 3)
    assert picture.width > 900 and picture.height > 600
    for colour in ((0xC9, 0xD2, 0xC4), (0xC2, 0x3B, 0x22), (0xFB, 0xFA, 0xF7)):
        assert np.count_nonzero(np.all(pixels == colour, axis=1)) > 30, colour
    dark_blue_path = np.all(np.abs(pixels - np.array([36.0, 24.0, 145.0])) < 30, axis=1)
    assert np.count_nonzero(dark_blue_path) > 500


def test_picture_is_byte_reproducible_and_names_no_software(folder: Path) -> None:
    first = write_picture(folder).read_bytes()
    assert write_picture(folder).read_bytes() == first
    assert b"matplotlib" not in first and b"tEXt" not in first


def test_picture_leaves_matplotlib_settings_alone(folder: Path) -> None:
    import matplotlib as mpl

    with mpl.rc_context({"font.size": 33.0, "axes.facecolor": "red"}):
        strange = write_picture(folder).read_bytes()
        assert mpl.rcParams["font.size"] == 33.0
    assert write_picture(folder).read_bytes() == strange


@pytest.mark.parametrize("yaw", [0.0, math.pi / 2])
def test_of_a_map_only_the_free_part_is_shown(yaw) -> None:
    """100 x 80 cells of 0.1 m; free are columns 40 to 59, rows 30 to 39: 1 m of what surrounds them is shown."""
    solid = np.ones((80, 100), np.uint8)
    solid[30:40, 40:60] = 0
    grid = grid_from_solid(solid, 0.1, (0.0, 0.0), yaw)
    robot = {"id": 0, "radius": 0.1, "start": (5.0, 3.5, 0.0), "goal": (4.5, 3.5)}
    world = WorldFile(robots=[robot], obstacles=[grid], bounds=(-10.0, -10.0, 10.0, 10.0))
    box = (3.0, 2.0, 7.0, 5.0) if yaw == 0.0 else (-5.0, 3.0, -2.0, 7.0)
    assert shown_bounds(world) == pytest.approx(box)
    assert shown_bounds(world.model_copy(update={"bounds": (4.0, 0.0, 6.0, 9.0)}))[0] == 4.0 or yaw > 0.0
    assert shown_bounds(world.model_copy(update={"obstacles": []})) == world.bounds


@pytest.mark.parametrize("yaw", [0.0, 0.3])
@pytest.mark.parametrize("wide", [4.0, 7.3])
def test_solid_parts_of_maps_have_no_seams(yaw, wide) -> None:
    """A block of 240 x 160 cells is one even tone, however many pixels a cell takes."""
    figure = Figure(figsize=(wide, 0.75 * wide), dpi=150)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(-6.0, 14.0)
    axes.set_ylim(-4.0, 11.0)
    draw_obstacles(axes, [grid_from_solid(np.ones((160, 240), np.uint8), 0.05, (1.0, 0.0), yaw)])
    canvas.draw()
    shown = np.asarray(canvas.buffer_rgba()).astype(int)
    y, x = np.mgrid[11.0 : -4.0 : shown.shape[0] * 1j, -6.0 : 14.0 : shown.shape[1] * 1j]
    along = (x - 1.0) * math.cos(yaw) + y * math.sin(yaw)
    across = y * math.cos(yaw) - (x - 1.0) * math.sin(yaw)
    inside = shown[(along > 0.2) & (along < 11.8) & (across > 0.2) & (across < 7.8)]
    assert np.ptp(inside, axis=0).max() <= 1


def test_close_pictures_show_where_robots_have_been(folder: Path) -> None:
    """1.5 m round everything, which is ten radii; else the whole world."""
    run = load_run(folder)
    x = np.concatenate([run.trajectory.x_m.ravel(), [robot.goal[0] for robot in run.world.robots]])
    y = np.concatenate([run.trajectory.y_m.ravel(), [robot.goal[1] for robot in run.world.robots]])
    box = (x.min() - 1.5, y.min() - 1.5, x.max() + 1.5, y.max() + 1.5)
    assert extent_of(run, close=True) == pytest.approx(box)
    without_map = replace(run, world=run.world.model_copy(update={"obstacles": []}))
    assert extent_of(without_map) == pytest.approx((0.0, 0.0, 12.0, max(8.0, y.max() + 0.3)))


def test_the_legend_names_what_is_there(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    named = []
    legend = Figure.legend

    def spy(self, handles, **more):
        named.append([handle.get_label() for handle in handles])
        return legend(self, handles=handles, **more)

    monkeypatch.setattr(Figure, "legend", spy)
    write_picture(folder)
    file = folder / "world.json"
    world = json.loads(file.read_text())
    world["obstacles"].append({"type": "circle", "center": [1, 1], "radius": 0.1, "velocity": [0.1, 0]})
    world["obstacles"].append({"type": "door", "points": [[1, 2], [2, 2]], "open_s": []})
    file.write_text(json.dumps(world))
    with np.load(folder / "trajectory.npz") as arrays:
        ticks = len(arrays["t_s"])
    rewrite_arrays(folder, disc_xy_m=np.zeros((ticks, 1, 2)), door_closed=np.zeros((ticks, 1), np.uint8))
    write_picture(folder)
    assert named[1] == [*named[0], "moves by itself", "door"]


def test_picture_shows_packets(folder: Path) -> None:
    """Green as it looks on the ground, in the picture of a run in which features were sent, else nowhere."""
    green = (0.55 * np.array([0x3D, 0x8F, 0x7D]) + 0.45 * np.array([0xFB, 0xFA, 0xF7])).round()
    counts = []
    for links in (load_run(folder).trajectory.links, np.zeros((0, 4), np.int32)):
        rewrite_arrays(folder, links=links)
        with Image.open(write_picture(folder)) as picture:
            pixels = np.asarray(picture.convert("RGB")).astype(float)
        counts.append(int((np.abs(pixels - green).max(axis=2) < 6).sum()))
    assert counts[0] > 200 and counts[1] < 20


def test_no_half_written_files_stay(folder: Path) -> None:
    before = {entry.name for entry in folder.iterdir()}
    write_picture(folder)
    assert {entry.name for entry in folder.iterdir()} == before | {"paths.png"}


def test_decisions_are_where_p_left_changes(folder: Path) -> None:
    trajectory = load_run(folder).trajectory
    for robot in range(6):
        chosen = decision_ticks(trajectory, robot)
        assert list(chosen) == list(np.flatnonzero(trajectory.state[:, robot] == 1))


def test_crash_is_dated_by_state_and_else_by_the_last_step(folder: Path) -> None:
    assert crash_ticks(load_run(folder).trajectory).tolist() == [60, 60, 60, 60, 30, 60]
    rewrite_arrays(folder, state_names=np.array(["a", "b", "c", "d", "e", "f", "g"]))
    assert crash_ticks(load_run(folder).trajectory).tolist() == [60, 60, 60, 60, 30, 60]


def test_words_with_and_without_figures(folder: Path) -> None:
    run = load_run(folder)
    assert headline(run) == "T1 · nav-scope · 6 robots · seed 7"
    assert dict(summary_rows(run))["Path redundancy γ"] == "8.3 %"
    (folder / "metrics.json").write_text("{}")
    bare = load_run(folder)
    assert headline(bare) == "6 robots"
    assert dict(summary_rows(bare)) == {"Arrived (AR)": "83.3 %", "Collisions": "1", "Last arrival": "22.0 s"}
    write_picture(folder)


def test_a_figure_without_a_value_is_a_dash(folder: Path) -> None:
    (folder / "metrics.json").write_text(json.dumps({"path_redundancy": None, "spl": float("nan")}))
    rows = dict(summary_rows(load_run(folder)))
    assert rows["Path redundancy γ"] == rows["SPL"] == "–"


@pytest.mark.parametrize("name", ["world.json", "trajectory.npz", "metrics.json"])
@pytest.mark.parametrize("damage", ["missing", "empty", "torn", "foreign"])
def test_damaged_files_are_named(folder: Path, name: str, damage: str) -> None:
    path = folder / name
    content = path.read_bytes()
    if damage == "missing":
        path.unlink()
    else:
        path.write_bytes({"empty": b"", "torn": content[: len(content) // 2], "foreign": b"[1, 2]"}[damage])
    with pytest.raises(InputFileError) as caught:
        write_picture(folder)
    assert name in str(caught.value)
    assert not (folder / "paths.png").exists()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"x_m": np.zeros((60, 5))}, "x_m"),
        ({"y_m": np.full((60, 6), np.nan)}, "y_m"),
        ({"t_s": np.zeros(60)}, "t_s"),
        ({"state": np.full((60, 6), 7, np.uint8)}, "state_names"),
        ({"links": np.array([[0, 6, 1, 20]])}, "links"),
        ({"scan_u8": np.zeros((60, 6, 71), np.uint8)}, "scan_u8"),
        ({"state": np.full((60, 6), "advance")}, "state"),
        ({"choices": np.array([[60, 0, 0.5, 0.5, 1, 0]])}, "choices names a tick or a robot"),
        ({"choices": np.array([[1, 0.5, 0.5, 0.5, 1, 0]])}, "choices names a tick or a robot"),
        ({"choices": np.array([[1, np.nan, 0.5, 0.5, 1, 0]])}, "choices names a tick or a robot"),
        ({"opinions": np.array([[999, 1, 1, 0.5, 0.5]])}, "opinions names a choice"),
        ({"opinions": np.array([[0, -1, 1, 0.5, 0.5]])}, "opinions names a choice"),
    ],
)
def test_arrays_that_do_not_fit_are_named(folder: Path, changes: dict[str, np.ndarray], words: str) -> None:
    rewrite_arrays(folder, **changes)
    with pytest.raises(InputFileError, match=words):
        load_run(folder)


def test_pickled_arrays_are_refused(folder: Path) -> None:
    rewrite_arrays(folder, x_m=np.array([{"a": 1}], dtype=object))
    with pytest.raises(InputFileError, match=r"trajectory\.npz"):
        load_run(folder)


def test_a_world_for_other_robots_is_refused(folder: Path) -> None:
    world = json.loads((folder / "world.json").read_text())
    world["robots"].pop()
    (folder / "world.json").write_text(json.dumps(world))
    with pytest.raises(InputFileError, match="5 robots"):
        load_run(folder)


def test_a_wrong_obstacle_is_named(folder: Path) -> None:
    world = json.loads((folder / "world.json").read_text())
    world["obstacles"][3]["radius"] = -1
    (folder / "world.json").write_text(json.dumps(world))
    with pytest.raises(InputFileError, match=r"world\.json: obstacles\.3"):
        load_run(folder)


def test_the_way_of_a_disc_begins_where_it_begins() -> None:
    axes = Figure().add_subplot()
    axes.set_xlim(0.0, 10.0)
    axes.set_ylim(0.0, 10.0)
    draw_obstacles(axes, [Circle(center=(5.0, 3.0), radius=0.3, velocity=(0.05, 0.0))])
    (way,) = axes.lines
    x, y = np.asarray(way.get_data())
    assert x[0] == 5.0 and x[-1] >= 10.0
    assert y == pytest.approx([3.0, 3.0])
    assert axes.get_xlim() == (0.0, 10.0)

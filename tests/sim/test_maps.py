"""Map files: the thresholds of map_server, both ways up, and a clear word for every malformed file."""

from __future__ import annotations

import contextlib
import math

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from swarmscope.errors import ConfigError, InputFileError, UnknownNameError
from swarmscope.sim.contact import static_clearance
from swarmscope.sim.maps import Trip, closed, load_map, load_movingai, load_trips, packaged_map, save_map
from swarmscope.sim.maps.movingai import check_trips, place_of
from swarmscope.sim.world import Grid, WorldSpec, compile_world, grid_corners, grid_from_solid, solid_from_grid

SETTINGS = {
    "image": "map.pgm",
    "resolution": 0.5,
    "origin": [1.0, -2.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}


def write_map(folder, content=b"P5\n2 2\n255\n\x00\xfe\xfe\xfe", name="map.pgm", **changes):
    (folder / name).write_bytes(content)
    settings = {key: value for key, value in {**SETTINGS, **changes}.items() if value != "drop"}
    (folder / "map.yaml").write_text(yaml.safe_dump(settings))
    return folder / "map.yaml"


def test_first_image_row_is_the_top(tmp_path):
    grid = load_map(write_map(tmp_path))
    assert grid == Grid(resolution=0.5, origin=(1.0, -2.0), width=2, height=2, rows=[(1, 0, 0)])


@pytest.mark.parametrize("free", [[(1, 1)], [(0, 1)], [(2, 3)], [(1, 0), (1, 1)], [(0, 3)]])
def test_a_map_that_is_free_at_its_edge_is_closed_beyond_it(free):
    solid = np.ones((3, 4), np.uint8)
    for row, col in free:
        solid[row, col] = 0
    grid = grid_from_solid(solid, 0.5, (1.0, -2.0))
    shut = closed(grid)
    if free == [(1, 1)]:
        assert shut is grid
        return
    assert shut.origin == (0.5, -2.5)
    cells = solid_from_grid(shut)
    assert np.array_equal(cells[1:-1, 1:-1], solid)
    assert cells[[0, -1]].all()
    assert cells[:, [0, -1]].all()


@pytest.mark.parametrize(
    ("grey", "changes", "solid"),
    [
        (205, {"free_thresh": 0.196}, True),  # p = 0.19608: unknown
        (205, {"free_thresh": 0.25}, False),
        (206, {"free_thresh": 0.196}, False),
        (0, {}, True),
        (254, {}, False),
        (255, {}, False),
        (100, {}, True),  # between the thresholds: unknown
        (0, {"negate": 1}, False),
        (255, {"negate": True}, True),
        (255, {"free_thresh": 0, "occupied_thresh": 1}, True),  # nothing is below 0
        (255, {"free_thresh": 0.001, "occupied_thresh": 1}, False),
        (205, {"free_thresh": 0.25, "mode": "scale"}, False),
        (150, {"free_thresh": 0.25, "mode": "scale"}, True),  # 0.41: neither free nor occupied
        (0, {"mode": "raw"}, False),  # the value itself: 0 is free,
        (1, {"mode": "raw"}, True),  # 1 to 100 more or less occupied,
        (255, {"mode": "raw"}, True),  # 255 unknown
        (0, {"mode": "raw", "negate": 1}, False),
        (254, {"free_thresh": 0.0}, True),
    ],
)
def test_thresholds(tmp_path, grey, changes, solid):
    grid = load_map(write_map(tmp_path, b"P5\n1 1\n255\n" + bytes([grey]), **changes))
    assert bool(grid.rows) is solid


def test_text_pgm_comments_png_and_other_depths_are_read(tmp_path):
    expected = load_map(write_map(tmp_path))
    assert load_map(write_map(tmp_path, b"P2\n# by hand\n2 2\n255\n0 254\n254 254\n")) == expected
    assert load_map(write_map(tmp_path, b"P5\n# a\n2 2 # b\n255\n\x00\xfe\xfe\xfe")) == expected
    assert load_map(write_map(tmp_path, b"P5\n2 2\n65535\n" + b"\x00\x00" + 3 * b"\xfe\xfe")) == expected
    assert load_map(write_map(tmp_path, b"P5\n2 2\n15\n\x00\x0f\x0f\x0f")) == expected
    cells = np.array([[0, 254], [254, 254]], dtype=np.uint8)
    for mode in ("L", "RGB", "P", "1"):
        Image.fromarray(cells).convert(mode).save(tmp_path / "map.png")
        image = (tmp_path / "map.png").read_bytes()
        assert load_map(write_map(tmp_path, image, "map.png", image="map.png")) == expected, mode


@pytest.mark.parametrize(
    ("pixel", "mode", "free"),
    [
        ((254, 254, 254, 255), "trinary", True),
        ((254, 254, 254, 0), "trinary", False),  # 0.75 bright: 0.25 occupied
        ((254, 254, 254, 200), "trinary", True),  # 0.054
        ((254, 254, 254, 254), "scale", False),  # not opaque: unknown
        ((254, 254, 254, 255), "scale", True),
        ((0, 0, 0, 0), "raw", True),
        ((255, 255, 0, 255), "trinary", False),  # 0.25
    ],
)
def test_transparency_is_read_as_map_server_does(tmp_path, pixel, mode, free):
    Image.new("RGBA", (1, 1), pixel).save(tmp_path / "map.png")
    path = write_map(tmp_path, (tmp_path / "map.png").read_bytes(), "map.png", image="map.png", mode=mode)
    assert (not load_map(path).rows) is free


def nav2_cell(pixel, full, mode, settings):
    """A cell as nav2's map_io calls it, pixel by pixel: 0 free, 100 occupied, -1 unknown, between for ``scale``."""
    colours, alpha = (pixel[:3], pixel[3]) if len(pixel) == 4 else (pixel, None)
    channels = [value / full for value in (pixel if alpha is not None and mode == "trinary" else colours)]
    shade = sum(channels) / len(channels)
    if mode == "raw":
        return round(shade * 255) if round(shade * 255) <= 100 else -1
    occupancy = shade if settings["negate"] else 1.0 - shade
    if mode == "scale" and alpha is not None and alpha < full:
        return -1
    if occupancy > settings["occupied_thresh"]:
        return 100
    if occupancy < settings["free_thresh"]:
        return 0
    return -1 if mode == "trinary" else 50


@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
@pytest.mark.parametrize("kind", ["L", "RGB", "RGBA", "LA", "I;16"])
@pytest.mark.parametrize("seed", range(4))
def test_every_cell_is_read_as_nav2_reads_it(tmp_path, mode, kind, seed):
    rng = np.random.default_rng([seed, len(kind)])
    full, channels = (65535, 1) if kind == "I;16" else (255, len(kind))
    values = rng.choice([0, 1, 50, 51, 101, 127, 205, 250, 254, 255], (9, 11, channels)) * (full // 255)
    if kind in ("RGBA", "LA"):
        values[..., -1] = np.where(rng.random((9, 11)) < 0.5, full, values[..., -1])
    shown = values.astype(np.uint16 if full > 255 else np.uint8)
    Image.fromarray(shown[..., 0] if channels == 1 else shown).save(tmp_path / "map.png")
    settings = {"negate": int(rng.integers(2)), "free_thresh": rng.choice([0.1, 0.196, 0.25]), "occupied_thresh": 0.65}
    settings = {name: float(value) if name != "negate" else value for name, value in settings.items()}
    image = (tmp_path / "map.png").read_bytes()
    grid = load_map(write_map(tmp_path, image, "map.png", image="map.png", mode=mode, **settings))
    if kind == "LA":
        values = values[..., [0, 0, 0, 1]]
    elif channels == 1 and full == 255:
        values = values[..., [0, 0, 0]]
    expected = [[nav2_cell(pixel.tolist(), full, mode, settings) == 0 for pixel in row] for row in values]
    assert np.array_equal(solid_from_grid(grid)[::-1] == 0, expected)


@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
@pytest.mark.parametrize("kind", ["P", "P one", "P all", "L one", "RGB one", "1"])
@pytest.mark.parametrize("seed", range(3))
def test_palettes_and_transparent_colours_are_read_as_nav2_reads_them(tmp_path, mode, kind, seed):
    """Paint programs write few colours as a palette; one of them may be transparent, or each as much as it likes."""
    rng = np.random.default_rng([seed, len(kind), len(mode)])
    colours = rng.choice([0, 1, 50, 127, 205, 250, 254, 255], (6, 4))
    colours[:, 3] = np.where(rng.random(6) < 0.5, 255, colours[:, 3])
    channels, _, extra = kind.partition(" ")
    if channels == "L":
        colours[:, 1] = colours[:, 2] = colours[:, 0]
    if channels == "1":
        colours = np.array([[0, 0, 0, 255], [255, 255, 255, 255]])
    numbers = rng.integers(len(colours), size=(9, 11))
    options = {}
    if extra != "all":
        clear = tuple(colours[0, :3].tolist())
        colours[:, 3] = [0 if extra == "one" and tuple(colour) == clear else 255 for colour in colours[:, :3].tolist()]
    if channels == "P":
        image = Image.fromarray(numbers.astype(np.uint8))
        image.putpalette(colours[:, :3].astype(np.uint8).tobytes())
        options = {"transparency": bytes(colours[:, 3].tolist())} if extra else {}
    else:
        image = Image.fromarray(colours[numbers][..., :3].astype(np.uint8)).convert(channels)
        options = {"transparency": clear[0] if channels == "L" else clear} if extra else {}
    image.save(tmp_path / "map.png", **options)
    settings = {"negate": int(rng.integers(2)), "free_thresh": 0.196, "occupied_thresh": 0.65}
    shown = (tmp_path / "map.png").read_bytes()
    grid = load_map(write_map(tmp_path, shown, "map.png", image="map.png", mode=mode, **settings))
    pixels = colours[numbers] if extra else colours[numbers][..., :3]
    expected = [[nav2_cell(pixel.tolist(), 255, mode, settings) == 0 for pixel in row] for row in pixels]
    assert np.array_equal(solid_from_grid(grid)[::-1] == 0, expected)


def test_the_picture_may_lie_anywhere(tmp_path, monkeypatch):
    expected = load_map(write_map(tmp_path))
    home, other = tmp_path / "home", tmp_path / "other"
    for folder in (home, other):
        folder.mkdir()
        (folder / "it.pgm").write_bytes((tmp_path / "map.pgm").read_bytes())
    monkeypatch.setenv("HOME", str(home))
    for name in ("~/it.pgm", str(other / "it.pgm"), "other/it.pgm"):
        assert load_map(_point_to(tmp_path, name)) == expected
    with pytest.raises(InputFileError, match=r"home/gone\.pgm: cannot be read \(No such file"):
        load_map(_point_to(tmp_path, "~/gone.pgm"))


def test_a_rotated_origin_turns_the_grid(tmp_path):
    """Three cells wide, two high, 0.5 m; turned by a quarter the columns count upwards from (1, -2)."""
    grid = load_map(write_map(tmp_path, b"P5\n3 2\n255\n\xfe\xfe\xfe\xfe\x00\xfe", origin=[1.0, -2.0, math.pi / 2]))
    assert (grid.origin, grid.yaw) == ((1.0, -2.0), pytest.approx(math.pi / 2))
    assert grid_corners(grid) == pytest.approx(np.array([[1.0, -2.0], [1.0, -0.5], [0.0, -0.5], [0.0, -2.0]]))
    world = compile_world(WorldSpec(obstacles=[grid], bounds=(0.0, -2.0, 1.0, -0.5)))
    assert static_clearance(world, 0.75, -1.25, 0.75, -1.25, 1.0) == 0.0  # the middle of column 1, row 0
    assert static_clearance(world, 0.3, -1.25, 0.3, -1.25, 1.0) == pytest.approx(0.2)
    save_map(grid, tmp_path / "again.yaml")
    assert load_map(tmp_path / "again.yaml") == grid


def test_a_picture_alone_needs_the_size_of_its_cells(tmp_path):
    write_map(tmp_path)
    grid = load_map(tmp_path / "map.pgm", 0.25)
    assert (grid.resolution, grid.origin, grid.rows) == (0.25, (0.0, 0.0), [(1, 0, 0)])
    with pytest.raises(ConfigError, match="how large its cells are"):
        load_map(tmp_path / "map.pgm")


def test_maps_that_are_too_large_are_refused_before_they_are_read(tmp_path, monkeypatch):
    monkeypatch.setattr("swarmscope.sim.maps.files.MOST_CELLS", 12)
    assert load_map(write_map(tmp_path, b"P5\n4 3\n255\n" + 12 * b"\xfe")).width == 4
    with pytest.raises(ConfigError, match="5 x 3 cells, at most 12"):
        load_map(write_map(tmp_path, b"P5\n5 3\n255\n"))
    monkeypatch.setattr("swarmscope.sim.maps.files.MOST_RUNS", 3)
    with pytest.raises(ConfigError, match="6 solid pieces of rows, at most 3"):
        load_map(write_map(tmp_path, b"P5\n4 3\n255\n" + 6 * b"\x00\xfe"))


def test_trips_of_the_moving_ai_benchmarks(tmp_path):
    file = tmp_path / "a.scen"
    file.write_text("version 1\n0\ta b.map\t8\t4\t1\t0\t6\t3\t7.5\n\n1 a.map 8 4 0 3 7 0 9\n")
    trips = load_trips(file)
    assert trips == [Trip((1, 0), (6, 3), (8, 4)), Trip((0, 3), (7, 0), (8, 4))]
    grid = Grid(resolution=0.5, origin=(0.0, 0.0), width=8, height=4, rows=[])
    assert place_of(trips[0].start, grid) == (0.75, 1.75)
    assert place_of(trips[0].goal, grid) == (3.25, 0.25)
    check_trips(file, trips, grid)
    with pytest.raises(ConfigError, match=r"map\.trips: .*a\.scen is for a map of 8 x 4 cells, and this one has 4 x 8"):
        check_trips(file, trips, Grid(resolution=0.5, origin=(0.0, 0.0), width=4, height=8, rows=[]))
    with pytest.raises(ConfigError, match=r"\(8, 0\) is not on the map of 8 x 4"):
        place_of((8, 0), grid)
    for text in ("", "1 a.map", "version 1\n0 a.map 8 4 1 0 6\n", "version 1\n0 a.map 8 4 -1 0 6 3 7.5\n"):
        file.write_text(text)
        if text != "":
            with pytest.raises(InputFileError, match=r"a\.scen"):
                load_trips(file)


def test_unknown_keys_and_exponents_are_accepted(tmp_path):
    path = write_map(tmp_path, colour="red", mode="trinary")
    path.write_text(path.read_text().replace("resolution: 0.5", "resolution: 5e-1"))
    assert load_map(path).resolution == 0.5


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        *(({key: "drop"}, f"{key}: is missing") for key in SETTINGS),
        ({"resolution": "wide"}, "resolution: must be a finite number"),
        ({"resolution": 0}, "resolution: must be above 0"),
        ({"resolution": -1}, "resolution: must be above 0"),
        ({"resolution": True}, "resolution: must be a finite number"),
        ({"resolution": float("nan")}, "resolution: must be a finite number"),
        ({"resolution": 1e30}, "resolution"),
        ({"resolution": [1]}, "resolution"),
        ({"origin": [0, 0]}, "origin: must be"),
        ({"origin": 3}, "origin: must be"),
        ({"origin": ["a", 0, 0]}, r"origin\[0\]"),
        ({"origin": [1e9, 0, 0]}, "origin"),
        ({"negate": 2}, "negate"),
        ({"negate": "no way"}, "negate"),
        ({"occupied_thresh": 1.5}, "occupied_thresh: must lie between 0 and 1"),
        ({"free_thresh": 0.9}, "free_thresh: 0.9 is above"),
        ({"mode": "trianry"}, "mode: must be one of trinary, scale, raw"),
        ({"mode": 7}, "mode: must be one of"),
        ({"image": "~nobody_of_this_name/map.pgm"}, "image: '~nobody"),
        ({"image": 5}, "image: must be a file name"),
    ],
)
def test_wrong_settings_name_the_file_and_the_key(tmp_path, changes, message):
    path = write_map(tmp_path, **changes)
    with pytest.raises(ConfigError, match=message) as error:
        load_map(path)
    assert str(path) in str(error.value)


@pytest.mark.parametrize(
    "image",
    [
        b"",
        b"P5\n2 2\n255\n\x00",
        b"P5\n2",
        b"P5\n-2 2\n255\n\x00",
        b"P5\n2 2\n0\n\x00\x00\x00\x00",
        b"P5\n99999 99999\n255\n\x00",
        b"P2\n2 2\n255\n1 2 3",
        b"P2\n2 2\n255\n1 2 3 900",
        b"P2\n2 2\n255\n1 2 3 x",
        b"not an image",
        b"\x89PNG\r\n\x1a\n\x00\x00",
    ],
)
def test_torn_images_are_refused(tmp_path, image):
    path = write_map(tmp_path, image)
    with pytest.raises(InputFileError, match=r"map\.pgm"):
        load_map(path)


def test_missing_files_and_things_that_are_no_yaml(tmp_path):
    with pytest.raises(InputFileError, match="nowhere"):
        load_map(tmp_path / "nowhere.yaml")
    with pytest.raises(InputFileError, match="gone"):
        load_map(_point_to(tmp_path, "gone.pgm"))
    for text in ("", "- 1\n", "a: [", "just words", "\x00"):
        (tmp_path / "bad.yaml").write_text(text)
        with pytest.raises(InputFileError, match=r"bad\.yaml"):
            load_map(tmp_path / "bad.yaml")
    (tmp_path / "bad.yaml").write_bytes(b"\xff\xfe\xfa")
    with pytest.raises(InputFileError, match=r"bad\.yaml"):
        load_map(tmp_path / "bad.yaml")


def _point_to(folder, name):
    path = write_map(folder)
    path.write_text(path.read_text().replace("map.pgm", name))
    return path


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=60))
def test_any_bytes_as_an_image_end_in_a_grid_or_an_input_error(tmp_path_factory, tail):
    folder = tmp_path_factory.mktemp("bytes")
    for head in (b"", b"P5\n", b"P2\n2 2\n255\n"):
        with contextlib.suppress(InputFileError, ConfigError):
            load_map(write_map(folder, head + tail))


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 9), st.integers(1, 9), st.randoms(use_true_random=False))
def test_save_and_load_round_trip(tmp_path_factory, height, width, random):
    path = tmp_path_factory.mktemp("round") / "map.yaml"
    solid = [[random.random() < 0.5 for _ in range(width)] for _ in range(height)]
    grid = grid_from_solid(solid, 0.1, (-3.25, 7.5))
    save_map(grid, path)
    assert load_map(path) == grid


def test_save_says_where_it_could_not_write(tmp_path):
    with pytest.raises(InputFileError, match="cannot be written"):
        save_map(grid_from_solid([[1]], 1.0, (0.0, 0.0)), tmp_path / "none" / "map.yaml")


def test_packaged_office_map():
    grid = load_map(packaged_map("willow_garage_office"))
    assert (grid.width, grid.height, grid.resolution) == (584, 526, 0.1)
    with Image.open(packaged_map("willow_garage_office").with_suffix(".pgm")) as image:
        grey = np.asarray(image)[::-1]
    assert np.array_equal(solid_from_grid(grid) == 0, grey >= 206)
    with pytest.raises(UnknownNameError, match="willow_garage_office"):
        packaged_map("willow_garage")


def test_packaged_lecture_building():
    grid = load_map(packaged_map("urjc_aulario"))
    assert (grid.width, grid.height, grid.resolution) == (2295, 1638, 0.05)
    solid = solid_from_grid(grid)
    assert 0.02 < np.mean(solid == 0) < 0.6  # most of the picture is what the laser never saw


MOVINGAI = "type octile\nheight 2\nwidth 3\nmap\n.@G\nST.\n"


def test_movingai_first_row_is_the_top(tmp_path):
    (tmp_path / "a.map").write_text(MOVINGAI)
    grid = load_movingai(tmp_path / "a.map")
    assert solid_from_grid(grid).tolist() == [[0, 1, 0], [0, 1, 0]]
    assert (grid.resolution, grid.origin) == (1.0, (0.0, 0.0))
    assert load_movingai(tmp_path / "a.map", resolution=0.25).resolution == 0.25
    (tmp_path / "a.map").write_text("type octile\nheight 2\nwidth 2\nmap\n@.\n..\n")
    assert load_movingai(tmp_path / "a.map").rows == [(1, 0, 0)]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("octile", "tile", "octile"),
        ("height 2", "height two", "line 2"),
        ("height 2", "height 3", "3 rows, the map has 2"),
        ("height 2", "height 1", "1 rows, the map has 2"),
        ("width 3", "width 4", "line 5: 3 cells instead of 4"),
        ("width 3", "wide 3", "line 3"),
        ("map\n", "", "not a Moving AI map"),
        ("G", "x", "line 5: unknown terrain"),
        (MOVINGAI, "", "not a Moving AI map"),
        (MOVINGAI, "type octile\nheight 0\nwidth 0\nmap\n", "width|height"),
    ],
)
def test_malformed_movingai_maps(tmp_path, old, new, message):
    path = tmp_path / "a.map"
    path.write_text(MOVINGAI.replace(old, new, 1))
    with pytest.raises((InputFileError, ConfigError), match=message) as error:
        load_movingai(path)
    assert str(path) in str(error.value)


def test_movingai_resolution_is_checked(tmp_path):
    (tmp_path / "a.map").write_text(MOVINGAI)
    with pytest.raises(ConfigError, match="resolution"):
        load_movingai(tmp_path / "a.map", resolution=-1.0)

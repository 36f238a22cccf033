"""Map files: the thresholds of map_server, both ways up, and a clear word for every malformed file."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from swarmscope.errors import ConfigError, InputFileError, UnknownNameError
from swarmscope.sim.maps import closed, load_map, load_movingai, packaged_map, save_map
from swarmscope.sim.world import Grid, grid_from_solid, solid_from_grid

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
        (51, {"free_thresh": 0.8, "occupied_thresh": 0.8}, True),  # p = 0.8: occupied comes first
        (255, {"free_thresh": 0, "occupied_thresh": 1}, False),
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
    for mode in ("L", "RGB", "RGBA", "P", "LA", "1"):
        Image.fromarray(cells).convert(mode).save(tmp_path / "map.png")
        image = (tmp_path / "map.png").read_bytes()
        assert load_map(write_map(tmp_path, image, "map.png", image="map.png")) == expected, mode


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
        ({"origin": [0, 0, 0.1]}, "rotated"),
        ({"origin": [0, 0]}, "origin: must be"),
        ({"origin": 3}, "origin: must be"),
        ({"origin": ["a", 0, 0]}, r"origin\[0\]"),
        ({"origin": [1e9, 0, 0]}, "origin"),
        ({"negate": 2}, "negate"),
        ({"negate": "no way"}, "negate"),
        ({"occupied_thresh": 1.5}, "occupied_thresh: must lie between 0 and 1"),
        ({"free_thresh": 0.9}, "free_thresh: 0.9 is above"),
        ({"mode": "scale"}, "only 'trinary'"),
        ({"mode": 7}, "only 'trinary'"),
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

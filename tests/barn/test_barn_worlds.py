"""Worlds from files: what is read, and what is refused with file and place."""

from __future__ import annotations

import numpy as np
import pytest
from barn_files import ROUND, WAY, arrays_of, clutter, model, path_m, world_text, write_folder, write_npz

from swarmscope.barn.world_file import MOST_BYTES, read_world_file
from swarmscope.barn.worlds import GOAL, START, chosen, find_worlds, metres, read_path_m
from swarmscope.errors import ConfigError, InputFileError

ENTITIES = "".join(f'<!ENTITY {name} "{text * 50}">' for name, text in (("a", "x"), ("b", "&a;"), ("c", "&b;")))
BOMB = f"<!DOCTYPE sdf [{ENTITIES}]>\n"


def read(folder, text):
    file = folder / "world_7.world"
    file.write_text(text)
    return read_world_file(file)


def test_a_world_file_gives_its_cylinders_and_nothing_else(tmp_path):
    wide = ROUND.replace("0.075", "0.2")
    found = read(tmp_path, world_text(model(-0.075, 4.5), model(-1.5, 6.25, "unit_cylinder_1", wide)))
    assert found.tolist() == [[-0.075, 4.5, 0.075], [-1.5, 6.25, 0.2]]


def test_a_saved_state_says_where_models_stand(tmp_path):
    state = "<state world_name='default'><model name='b'><pose>1 2 0 0 0 0</pose></model></state>"
    found = read(tmp_path, world_text(model(0, 4, "a"), model(0, 5, "b"), more=state))
    assert found[:, :2].tolist() == [[0, 4], [1, 2]]


BAD = {
    "torn": (world_text(model(0, 4))[:-40], "torn, or no XML"),
    "empty": ("", "torn, or no XML"),
    "no xml": ("task: {name: T1}", "torn, or no XML"),
    "unknown entity": (world_text(model("&x;", 4)), "torn, or no XML"),
    "other xml": ("<html><world/></html>", "no <sdf> with a <world>, but <html>"),
    "no world": ("<sdf version='1.6'/>", "no <sdf> with a <world>"),
    "no cylinder": (world_text(), "holds no cylinder"),
    "nan": (world_text(model("nan", 4)), "model 'unit_cylinder_0': <pose> must be 6 finite numbers"),
    "infinity": (world_text(model(0, "1e999")), "<pose> must be 6 finite numbers"),
    "words": (world_text(model("left", 4)), "<pose> must be 6 finite numbers, not 'left 4 0 0 0 0'"),
    "short pose": (world_text(model(0, 4, pose="{} {}")), "<pose> must be 6 finite numbers, not '0 4'"),
    "tilted": (world_text(model(0, 4, pose="{} {} 0 0.3 0 0")), "the cylinder is tilted"),
    "no radius": (world_text(model(0, 4, shape="<cylinder/>")), "<radius> must be 1 finite number, not ''"),
    "negative": (world_text(model(0, 4, shape=ROUND.replace("0.07", "-0.07"))), "<radius> must be more than 0"),
    "box": (world_text(model(0, 4, shape="<box><size>1 1 1</size></box>")), "is a box; only cylinders are read"),
    "aside": (
        world_text(model(0, 4).replace("<link name='link'>", "<link name='link'><pose>1 0 0 0 0 0</pose>")),
        "<link> stands aside of its model",
    ),
    "other file": (world_text(model(0, 4), more="<include><uri>model://tree</uri></include>"), "includes model://tree"),
    "bomb": (BOMB + world_text(model(0, 4)).replace("default", "&c;"), "declares the document type 'sdf'"),
    "outer entity": (
        '<!DOCTYPE sdf [<!ENTITY a SYSTEM "file:///etc/hostname">]>\n' + world_text(model(0, "&a;")),
        "declares the document type 'sdf'",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_world_file_is_refused_in_one_line(case, tmp_path):
    text, reason = BAD[case]
    with pytest.raises(InputFileError) as error:
        read(tmp_path, text)
    assert reason in str(error.value) and "world_7.world: " in str(error.value)
    assert "\n" not in str(error.value)


def test_a_huge_or_missing_world_file_is_refused(tmp_path):
    with pytest.raises(InputFileError, match="larger than 32 MiB"):
        read(tmp_path, " " * (MOST_BYTES + 1))
    with pytest.raises(InputFileError, match="No such file"):
        read_world_file(tmp_path / "world_9.world")


def test_the_way_leads_from_the_start_through_the_cells_to_the_goal(tmp_path):
    # By hand: column 15, row 0 is at x = 15 * 0.15 - 4.575 = -2.325, y = 5.075.
    assert metres(np.array([[15.0, 0.0]]))[0].tolist() == pytest.approx([-2.325, 5.075])
    np.save(tmp_path / "path_1.npy", np.array([[15, 0], [15, 29]]))
    straight = np.hypot(0.075, 2.075) + 29 * 0.15 + np.hypot(0.075, 13.0 - 9.425)
    assert read_path_m(tmp_path / "path_1.npy") == pytest.approx(straight, abs=1e-12)


BAD_PATHS = {
    "torn": lambda file: file.write_bytes(file.read_bytes()[:-9]),
    "text": lambda file: file.write_text("1 2"),
    "empty": lambda file: file.write_bytes(b""),
    "one axis": lambda file: np.save(file, np.arange(4)),
    "nan": lambda file: np.save(file, np.full((2, 2), np.nan)),
    "pickle": lambda file: np.save(file, np.array([[1, None]], dtype=object), allow_pickle=True),
    "large": lambda file: np.save(file, np.zeros((1 << 17, 2))),
}


@pytest.mark.parametrize("case", BAD_PATHS)
def test_a_bad_path_file_is_refused(case, tmp_path):
    file = tmp_path / "path_1.npy"
    np.save(file, WAY)
    BAD_PATHS[case](file)
    with pytest.raises(InputFileError, match=r"path_1\.npy: "):
        read_path_m(file)


def test_a_folder_and_a_npz_give_the_same_worlds(tmp_path):
    ours = {36: clutter(1), 8: clutter(2), 100: clutter(3)}
    folder = find_worlds(write_folder(tmp_path / "BARN", ours))
    arrays = find_worlds(write_npz(tmp_path / "barn.npz", ours))
    assert folder.numbers == arrays.numbers == [8, 36, 100]
    for number in folder.numbers:
        a, b = folder.read(number), arrays.read(number)
        assert np.array_equal(a.discs, b.discs) and a.discs[:, :2].tolist() == ours[number].tolist()
        assert (a.number, a.start, a.goal) == (b.number, b.start, b.goal) == (number, START, GOAL)
        assert a.path_m == pytest.approx(b.path_m, abs=1e-12) == path_m()


def test_single_precision_gives_the_same_worlds(tmp_path):
    ours = {1: clutter(1)}
    single = find_worlds(write_npz(tmp_path / "barn.npz", ours, centers_m=ours[1].astype(np.float32)))
    assert single.read(1).discs[:, :2].tolist() == ours[1].tolist()


def test_worlds_may_lie_in_the_folder_itself_and_paths_may_be_missing(tmp_path):
    folder = write_folder(tmp_path / "BARN", {3: clutter(1)})
    beside = find_worlds(folder / "world_files").read(3)
    assert beside.path_m == find_worlds(folder).read(3).path_m
    (folder / "path_files/path_3.npy").unlink()
    assert np.isnan(find_worlds(folder).read(3).path_m)


def test_a_folder_without_worlds_is_refused(tmp_path):
    (tmp_path / "world.txt").write_text("")
    with pytest.raises(InputFileError, match=r"holds no world_N\.world"):
        find_worlds(tmp_path)


OURS = {1: clutter(1), 4: clutter(2)}
SOUND = arrays_of(OURS)
BAD_ARRAYS = {
    "world": [None, np.array([1, 1]), np.array([1.5, 2.0]), np.array([-1, 2]), np.zeros(0), np.array(["a", "b"])],
    "offsets": [None, np.array([0, 24]), np.array([0, 20, 23]), np.array([1, 12, 24]), np.array([0, 30, 24])],
    "centers_m": [None, SOUND["centers_m"][:, :1], SOUND["centers_m"] * np.nan, SOUND["centers_m"][1:]],
    "radius_m": [None, np.array(0.0), np.array(np.inf), np.array([0.1, 0.1])],
    "start": [None, np.zeros(2)],
    "goal": [None, np.zeros(3)],
    "path_length_m": [None, np.ones(1), np.array([1.0, 0.0]), np.array([1.0, np.nan])],
}


@pytest.mark.parametrize(("key", "k"), [(key, k) for key, values in BAD_ARRAYS.items() for k in range(len(values))])
def test_a_bad_npz_is_refused_with_its_key(key, k, tmp_path):
    file = write_npz(tmp_path / "barn.npz", OURS, **{key: BAD_ARRAYS[key][k]})
    with pytest.raises(InputFileError, match=r"barn\.npz: .*'(world|offsets|" + key + ")'"):
        find_worlds(file)


def test_a_torn_or_missing_npz_is_refused(tmp_path):
    file = write_npz(tmp_path / "barn.npz", OURS)
    file.write_bytes(file.read_bytes()[:-50])
    with pytest.raises(InputFileError, match="torn or foreign"):
        find_worlds(file)
    with pytest.raises(InputFileError, match="No such file"):
        find_worlds(tmp_path / "nowhere.npz")


def test_worlds_are_chosen_by_number_and_by_step():
    assert chosen([0, 2, 4, 6], [], 1) == [0, 2, 4, 6]
    assert chosen([0, 2, 4, 6], [], 3) == [0, 6]
    assert chosen([0, 2, 4, 6], [6, 2, 4], 2) == [2, 6]
    with pytest.raises(ConfigError, match="--worlds: there is no world 3; there are 4, 0 to 6"):
        chosen([0, 2, 4, 6], [2, 3], 1)

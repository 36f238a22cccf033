"""Gazebo's world files as maps: what stands, and what DynaBARN's plugins move."""

from __future__ import annotations

import math

import pytest

from swarmscope.errors import InputFileError
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.sim.maps.gazebo import load_world
from swarmscope.sim.moving import disc_at, moving_in

SHAPE = "<link name='l'><collision name='c'><geometry>{}</geometry></collision></link>"
CYLINDER = SHAPE.format("<cylinder><radius>0.5000</radius><length> 1 </length></cylinder>")
BOX = SHAPE.format("<box><size>.5 20 1</size></box>")
WALL = f"<model name='back_wall'>\n<static>1</static>\\   <pose frame=>-10 0 .5 0 0 0</pose>{BOX}</model>"
"""As DynaBARN writes it, which is no XML."""
TURNED = f"<model name='bar'><pose>5 1 0 0 0 {0.5 * math.pi}</pose>{BOX}</model>"
MOVER = (
    "<model name='m'><pose frame=''>-0.2 0.1 0 0 0 0</pose>"
    + CYLINDER
    + "<plugin name='{0}' filename='{0}.so'/></model>"
)
FRAME = "key = anim->CreateKeyFrame({:.2f});\nkey->Translation(ignition::math::Vector3d({:.2f}, {:.2f}, 0));\n"


def written(folder, *models, frames=((0.0, -9.0, 0.0), (4.0, -9.0, 8.0), (4.0, 1.0, 1.0), (6.0, -9.0, 9.0))):
    (folder / "worlds").mkdir()
    (folder / "plugins").mkdir()
    (folder / "plugins" / "obs_7.cc").write_text(
        'new PoseAnimation("obs_7", 6.00, true));' + "".join(FRAME.format(*f) for f in frames)
    )
    path = folder / "worlds" / "world_0.world"
    include = "<include><uri>model://sun</uri></include>"
    path.write_text(
        f'<?xml version="1.0" ?><sdf version="1.6"><world name="d">{include}{"".join(models)}</world></sdf>'
    )
    return path


def test_boxes_cylinders_and_a_cylinder_on_its_way(tmp_path):
    spec = load_world(written(tmp_path, WALL, TURNED, MOVER.format("libobs_7")))
    wall, bar, mover = spec.obstacles
    assert sorted(wall.points) == [(-10.25, -10.0), (-10.25, 10.0), (-9.75, -10.0), (-9.75, 10.0)]
    assert max(x for x, _ in bar.points) == pytest.approx(15.0) and mover.radius == 0.5
    motion = moving_in(spec)
    assert disc_at(motion, 0, 2.0) == pytest.approx((-9.0, 4.0)) and disc_at(motion, 0, 5.0) == pytest.approx(
        (-9.0, 8.5)
    )
    assert disc_at(motion, 0, 10.0) == pytest.approx((-9.0, 4.0)), "after 6 s it walks back"


def test_robots_start_in_it_where_they_are_told_to(tmp_path):
    path = written(tmp_path, WALL, TURNED, MOVER.format("libobs_7"))
    setup = make_setup(parse_scenario({"map": {"file": str(path), "starts": [[0, 0]], "goals": [[5, 4]]}}, "test"))
    assert setup.world.bounds == pytest.approx((-11.25, -11.0, 16.0, 11.0)) and setup.starts[0, :2].tolist() == [0, 0]


@pytest.mark.parametrize(
    ("models", "message"),
    [
        ([], "holds no cylinder and no box"),
        (["<model name='x'><pose>0 0 0 1 0 0</pose>" + CYLINDER + "</model>"], "model 'x' is tilted"),
        (["<model name='x'>" + SHAPE.format("<sphere/>") + "</model>"], "model 'x' is a sphere"),
        (["<model name='x'><pose>0 a</pose>" + BOX + "</model>"], "must be 6 finite numbers, not '0 a'"),
        ([MOVER.format("libother")], r"source other\.cc is not beside it"),
        ([MOVER.format("../evil")], "is not called libNAME.so"),
        (["<model>"], "torn, or no XML"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, models, message):
    with pytest.raises(InputFileError, match=message):
        load_world(written(tmp_path, *models))


def test_entities_are_refused(tmp_path):
    path = tmp_path / "w.world"
    path.write_text('<!DOCTYPE x [<!ENTITY a "b">]><sdf><world/></sdf>')
    with pytest.raises(InputFileError, match="declares the document type"):
        load_world(path)


def test_one_key_frame_is_no_way(tmp_path):
    with pytest.raises(InputFileError, match=r"obs_7\.cc holds no two key frames"):
        load_world(written(tmp_path, MOVER.format("libobs_7"), frames=[(0.0, 1.0, 1.0)]))

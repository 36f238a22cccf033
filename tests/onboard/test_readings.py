"""What readings mean to a robot: values that mean no return, the robot's own posts, LiDARs that hang, millimetres."""

from __future__ import annotations

import math

import numpy as np
import pytest

from robots import OPEN, Driver, LaserScan, box_left, brakes, new_robot
from swarmscope.errors import ConfigError
from swarmscope.onboard.lidar import Lidar, check_lidar, lay_out
from swarmscope.onboard.readings import are_millimetres, must_be_millimetres, own_rays, translate

POSTS = ((-46.5, -43.5), (43.5, 46.5), (133.5, 136.5), (-136.5, -133.5))


def with_posts(scan):
    scan = scan.copy()
    for first, last in POSTS:
        scan[math.ceil(180 + first) : math.floor(180 + last) + 1] = 0.1
    return scan


def seen(lidar, scan, **values):
    driver = Driver(new_robot(lidar=lidar))
    assert driver.tick(scan, **values).ok
    return driver.robot.rows.scan


@pytest.mark.parametrize(
    ("sheet", "said"),
    [((0.0,), 0.0), ((-1.0,), -1.0), (0.0, 0.0), ((math.nan,), math.nan), ((0.0, -1.0), -1.0), ((), 5.1), ((), np.inf)],
)
def test_values_that_mean_no_return(sheet, said):
    scan = np.where(np.isinf(box_left()), said, box_left())
    assert np.array_equal(seen(Lidar(no_return_m=sheet), scan), box_left())


def test_they_are_broken_if_nobody_says_so():
    scan = np.where(np.isinf(box_left()), -1.0, box_left())
    assert seen(Lidar(), scan)[np.isinf(box_left())].max() < 0.2
    driver = Driver()
    assert brakes(driver.tick(np.full(360, -np.inf)))


@pytest.mark.parametrize("mount", [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.0, math.pi / 2)])
def test_a_robots_own_posts_are_bridged(mount):
    """In the open a robot with posts drives as one without, wherever its sensor sits."""
    plain, masked = (Driver(new_robot(lidar=Lidar(mount=mount, masks_deg=masks))) for masks in ((), POSTS))
    blocked = Driver(new_robot(lidar=Lidar(mount=mount)))
    for _ in range(6):
        expected, found, stuck = plain.tick(OPEN), masked.tick(with_posts(OPEN)), blocked.tick(with_posts(OPEN))
        assert found[:2] == pytest.approx(expected[:2], abs=1e-3)
        assert stuck.ok
    assert expected.v > 0.3 > stuck.v


def test_masks_go_with_the_sensor_and_across_the_back():
    layout = lay_out(360, -math.pi + 0.5 * math.pi, math.radians(1.0), 5.0)
    looks = np.degrees(layout.rays.start + layout.rays.increment * np.arange(360))
    ahead = looks[own_rays(layout, [(-2.0, 2.0)], 0.5 * math.pi)]
    assert np.sort(ahead) == pytest.approx([88.0, 89.0, 90.0, 91.0, 92.0])
    assert own_rays(layout, [(178.0, -178.0)]).sum() == 5
    assert own_rays(layout, [(0.0, 360.0)]).all() and not own_rays(layout, []).any()


@pytest.mark.parametrize("hole", [[180], [170, 190, 200]])
@pytest.mark.parametrize("moved", [0.0, 0.05])
def test_a_broken_reading_bars_no_way_when_a_scan_is_moved_on(hole, moved):
    """Once every broken ray of a sensor off the centre stood as a wall from the body outwards."""
    scan = np.full(360, 3.0, np.float32)
    scan[hole] = np.nan
    driver = Driver(new_robot(lidar=Lidar(mount=(0.1, 0.0, 0.0))))
    for _ in range(4):
        driver.tick(scan, moved=(moved, 0.0, 0.0), speed=moved / 0.2)
    assert driver.robot.rows.scan.min() > 2.0
    scan[100:200] = np.nan
    driver.tick(scan)
    assert np.nanmin(driver.robot.rows.scan) < 0.3


def test_what_an_eccentric_sensor_is_blind_to_is_not_bridged():
    """It measures from 0.2 m on: two readings that are none may be a post as thick as a thumb beside the body."""
    scan = np.full(360, 3.0, np.float32)
    scan[150:153] = np.nan
    for least, near in ((0.0, False), (0.2, True)):
        found = seen(Lidar(mount=(0.1, 0.0, 0.0), range_min_m=least), scan)
        assert (found.min() < 0.3) == near


def test_a_lidar_that_hangs_upside_down():
    hanging, mirrored = Lidar(upside_down=True), np.roll(box_left()[::-1], 1)
    assert np.array_equal(seen(hanging, mirrored), box_left())
    assert np.array_equal(seen(hanging, LaserScan(mirrored)), box_left())
    backwards = LaserScan(box_left(), math.pi, -math.pi / 180.0)
    assert np.array_equal(seen(hanging, backwards), box_left())
    assert np.array_equal(seen(Lidar(upside_down=True, clockwise=True), box_left()), box_left())


def test_millimetres_are_no_open_field():
    """A scan in millimetres had shown nothing anywhere: every reading lay beyond the range."""
    driver = Driver()
    for scan in (1000.0 * np.linspace(0.3, 4.0, 360), LaserScan((1000 * np.linspace(0.3, 4.0, 360)).astype(np.uint16))):
        command = driver.tick(scan)
        assert brakes(command) and "millimetres" in command.reason
    for far in (np.linspace(6.0, 80.0, 360), np.full(360, 65535.0), np.where(np.arange(360) < 9, 65.0, 65535.0)):
        assert driver.tick(far).ok and np.isinf(driver.robot.rows.scan).all()


def test_when_readings_are_millimetres():
    assert are_millimetres(np.array([500.0, 4000.0, np.inf]), 0.1, 30.0)
    assert not are_millimetres(np.array([50.0, 20.0]), 0.1, 30.0)
    assert not are_millimetres(np.array([np.inf, np.nan, 0.0, -1.0]), 0.1, 30.0)
    assert must_be_millimetres(np.array([500.0, 4000.0]), 0.0, 5.0)
    assert not must_be_millimetres(np.array([60.0, 4000.0]), 0.0, 5.0)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("no_return_m", "zero"),
        ("no_return_m", (math.inf,)),
        ("no_return_m", (None,)),
        ("masks_deg", (40.0, 50.0)),
        ("masks_deg", ((40.0, math.nan),)),
        ("masks_deg", 5),
        ("masks_deg", ((1, 2, 3),)),
    ],
)
def test_what_is_no_reading_or_mask_is_refused(field, value):
    with pytest.raises(ConfigError, match=f"lidar.{field}"):
        check_lidar(Lidar(**{field: value}))


def test_a_value_beyond_all_numbers_of_a_scan_means_no_return_and_warns_of_nothing(recwarn):
    values = np.array([1.0, 0.0, np.inf], np.float32)
    translate(values, [0.0, 1e300])
    assert values.tolist() == [1.0, np.inf, np.inf] and not recwarn.list

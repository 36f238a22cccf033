"""The LiDAR's data sheet: which reading looks where."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmscope.errors import ConfigError
from swarmscope.onboard.lidar import Lidar, check_lidar, grid_of, lay_out, layout_of, sensor_of
from swarmscope.onboard.sensor import all_round
from swarmscope.sim.beams import make_beams


def directions(lidar):
    """The direction of every reading by the data sheet, one by one."""
    field = math.radians(lidar.fov_deg)
    step = 2.0 * math.pi / lidar.beams if lidar.fov_deg == 360.0 else field / (lidar.beams - 1)
    first = -0.5 * field if lidar.first_deg is None else math.radians(lidar.first_deg)
    if lidar.clockwise:
        step, first = -step, 0.5 * field if lidar.first_deg is None else first
    return first + step * np.arange(lidar.beams) + lidar.mount[2]


@pytest.mark.parametrize(("beams", "fov"), [(360, 360.0), (181, 180.0), (720, 270.0), (1081, 270.0), (64, 57.0)])
def test_the_usual_scan_lies_as_the_simulator_casts_it(beams, fov):
    layout = layout_of(check_lidar(Lidar(beams, 5.0, fov_deg=fov)))
    cast = make_beams(beams, math.radians(fov), 5.0)
    sensor = sensor_of(Lidar(beams, 5.0, fov_deg=fov), grid_of(layout))
    assert (layout.order == np.arange(beams)).all()
    assert (sensor.angle_min, sensor.increment, sensor.wraps) == (cast.angle_min, cast.increment, cast.wraps)
    assert (sensor.first, sensor.field) == (0, 0)
    assert [type(v) for v in sensor] == [int, float, float, bool, float, float, float, float, int, int]


@pytest.mark.parametrize(
    ("beams", "fov", "total", "first"),
    [
        (181, 180.0, 360, 89),  # 1 degree apart: 179 beams are not in view, 89 of them before the first one
        (1081, 270.0, 1440, 179),
        (64, 57.0, 397, 166),  # 0.905 degrees apart: 397.9 fit into the circle
        (100, 357.0, 100, 0),  # 3.606 degrees apart, 3 are left: no beam fits between the last and the first
    ],
)
def test_a_limited_view_is_a_part_of_the_full_circle(beams, fov, total, first):
    lidar = check_lidar(Lidar(beams, 5.0, fov_deg=fov))
    part = sensor_of(lidar, grid_of(layout_of(lidar)))
    whole = all_round(part)
    assert (whole.beams, whole.first, whole.field) == (total, first, beams if total > beams else 0)
    assert whole.wraps and whole.increment == part.increment
    assert whole.angle_min + first * whole.increment == pytest.approx(math.radians(-0.5 * fov))
    left = 2.0 * math.pi - whole.increment * (total - 1)
    assert 0.5 * whole.increment < left < 2.0 * whole.increment
    assert all_round(whole) == whole


lidars = st.fixed_dictionaries(
    {
        "beams": st.integers(8, 400),
        "fov_deg": st.one_of(st.just(360.0), st.floats(90.0, 359.0)),
        "first_deg": st.one_of(st.none(), st.floats(-400.0, 400.0)),
        "clockwise": st.booleans(),
        "mount": st.tuples(st.just(0.0), st.just(0.0), st.floats(-7.0, 7.0)),
    }
).map(lambda values: Lidar(**values))


@given(lidar=lidars)
def test_every_ray_has_the_reading_of_its_direction(lidar):
    try:
        layout = layout_of(check_lidar(lidar))
    except ConfigError as error:
        assert "straight ahead" in str(error)
        assert not layout_contains_ahead(lidar)
        return
    rays, order = layout.rays, layout.order
    angles = rays.start + rays.increment * np.arange(order.size)
    off = np.remainder(directions(lidar)[order] - angles + math.pi, 2.0 * math.pi) - math.pi
    assert np.abs(off).max() < 0.01 * rays.increment
    assert np.unique(order).size == order.size
    assert rays.closed or -math.pi - 0.01 * rays.increment <= angles[0] <= angles[-1] <= math.pi + 0.01
    if lidar.fov_deg == 360.0:
        assert rays.closed
        assert angles[0] < -math.pi + rays.increment
        assert order.size == lidar.beams


def layout_contains_ahead(lidar):
    angles = np.sort(np.remainder(directions(lidar) + math.pi, 2.0 * math.pi) - math.pi)
    return (angles <= 0.0).sum() >= 8 and (angles >= 0.0).sum() >= 8 and np.diff(angles).max() < math.radians(1.0)


@pytest.mark.parametrize(
    ("count", "step", "closed"),
    [(360, 2 * math.pi / 360, True), (360, 2 * math.pi / 359, True), (361, 2 * math.pi / 360, True),
     (360, 2 * math.pi / 361, False), (358, 2 * math.pi / 360, False), (270, math.pi / 180, False)],
)  # fmt: skip
def test_a_circle_is_closed_when_no_more_than_a_beam_is_missing(count, step, closed):
    for sign in (1.0, -1.0):
        layout = lay_out(count, 0.0 if closed else sign * -0.5 * count * step, sign * step, 5.0)
        assert layout.rays.closed is closed
        assert grid_of(layout).order.size == count
        if closed:
            assert grid_of(layout).rays.increment * count == pytest.approx(2.0 * math.pi)


WRONG = [
    ("lidar.beams", {"beams": 0}), ("lidar.beams", {"beams": -3}), ("lidar.beams", {"beams": 10**8}),
    ("lidar.beams", {"beams": 12.5}), ("lidar.beams", {"beams": math.nan}), ("lidar.beams", {"beams": "360"}),
    ("lidar.range_m", {"range_m": math.inf}), ("lidar.range_m", {"range_m": -5.0}), ("lidar.range_m", {"range_m": 0}),
    ("lidar.range_m", {"range_m": math.nan}), ("lidar.range_m", {"range_m": 1e30}), ("lidar.range_m", {"range_m": ""}),
    ("lidar.range_min_m", {"range_min_m": -0.1}), ("lidar.range_min_m", {"range_min_m": 5.0}),
    ("lidar.fov_deg", {"fov_deg": 0.0}), ("lidar.fov_deg", {"fov_deg": 361.0}), ("lidar.fov_deg", {"fov_deg": -90.0}),
    ("lidar.fov_deg", {"fov_deg": math.nan}), ("lidar.fov_deg", {"fov_deg": 1e-3}),
    ("lidar.first_deg", {"first_deg": math.inf}), ("lidar.first_deg", {"fov_deg": 90.0, "first_deg": 120.0}),
    ("lidar.range_sigma", {"range_sigma": -0.1}), ("lidar.position_sigma", {"position_sigma": 2.0}),
    ("lidar.mount", {"mount": (0.0, 0.0)}), ("lidar.mount", {"mount": None}),
    ("lidar.mount", {"mount": (0, 0, math.nan)}),
    ("lidar.mount", {"mount": ("a", 0, 0)}), ("lidar.mount", {"fov_deg": 90.0, "mount": (0.0, 0.0, math.pi)}),
]  # fmt: skip


@pytest.mark.parametrize(("field", "values"), WRONG)
def test_an_impossible_data_sheet_is_an_error_with_the_fields_name(field, values):
    with pytest.raises(ConfigError) as error:
        layout_of(check_lidar(Lidar(**values)))
    assert error.value.where == field


def test_a_field_turned_sideways_is_cut_behind_the_robot():
    lidar = check_lidar(Lidar(271, fov_deg=270.0, mount=(0.0, 0.0, math.radians(60.0))))
    layout = layout_of(lidar)
    assert math.degrees(layout.rays.start) == pytest.approx(-75.0)
    assert layout.order.size == 256

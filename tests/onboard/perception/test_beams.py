"""Which beam looks at a point: found quickly, and always the one that ``math.atan2`` says."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swarmscope._jit import jit
from swarmscope.geometry import ROUGH, rough_angle
from swarmscope.onboard.perception.beams import lies_between, nearest_beam
from swarmscope.onboard.sensor import Sensor, all_round


def sensor_of(beams, fov_deg):
    fov = math.radians(fov_deg)
    return all_round(Sensor(beams, -0.5 * fov, fov / (beams - 1), False, 0.0, 5.0, 0.0, 0.0))


def plain_beam(x, y, turned, sensor):
    bearing = math.atan2(y, x) - turned
    return math.floor((bearing - sensor.angle_min) / sensor.increment + 0.5) % sensor.beams


def plainly_between(x, y, first, last, sensor):
    beam = (math.atan2(y, x) - sensor.angle_min) / sensor.increment
    if beam < 0.0:
        beam += 2.0 * math.pi / sensor.increment
    return first <= beam <= last


@jit
def beams_of(x, y, turned, sensor, found):
    for k in range(x.size):
        found[k] = nearest_beam(x[k], y[k], turned[k], sensor)


@jit
def all_between(x, y, first, last, sensor, found):
    for k in range(x.size):
        found[k] = lies_between(x[k], y[k], first, last, sensor)


@jit
def angles_of(x, y, found):
    for k in range(x.size):
        found[k] = rough_angle(x[k], y[k])


def points(sensor):
    """Return points all round: random ones, some on the axes, some on the borders of beams or next to them."""
    rng = np.random.default_rng(5)
    angle = rng.uniform(-math.pi, math.pi, 20000)
    border = sensor.angle_min + sensor.increment * (0.5 * np.arange(2 * sensor.beams))
    near = border + rng.uniform(-3e-6, 3e-6, border.size)
    angle = np.concatenate([angle, border, near, [0.0, math.pi, -math.pi, 0.5 * math.pi]])
    far = rng.uniform(0.01, 20.0, angle.size)
    x, y = far * np.cos(angle), far * np.sin(angle)
    odd = [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (-1.0, -0.0), (0.0, 2.0), (0.0, -2.0), (1.0, 1.0), (-3.0, 3.0)]
    return np.append(x, [p[0] for p in odd]), np.append(y, [p[1] for p in odd])


@pytest.mark.parametrize(("beams", "fov_deg"), [(60, 60.0), (333, 163.2), (1440, 60.0), (1440, 359.0), (61, 300.0)])
def test_the_beam_is_that_of_atan2(beams, fov_deg):
    sensor = sensor_of(beams, fov_deg)
    x, y = points(sensor)
    for turned in (np.zeros(x.size), np.random.default_rng(1).uniform(-math.pi, math.pi, x.size)):
        found = np.zeros(x.size, np.int64)
        beams_of(x, y, turned, sensor, found)
        wanted = [plain_beam(*point, sensor) for point in zip(x.tolist(), y.tolist(), turned.tolist(), strict=True)]
        np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize(("beams", "fov_deg"), [(60, 60.0), (333, 163.2), (1440, 359.0)])
def test_what_lies_between_two_beams_is_what_atan2_says(beams, fov_deg):
    sensor = sensor_of(beams, fov_deg)
    x, y = points(sensor)
    for first, last in ((sensor.first, sensor.first + sensor.field - 1), (0, sensor.beams - 1), (3, 3)):
        found = np.zeros(x.size, np.bool_)
        all_between(x, y, first, last, sensor, found)
        wanted = [plainly_between(*point, first, last, sensor) for point in zip(x.tolist(), y.tolist(), strict=True)]
        np.testing.assert_array_equal(found, wanted)


def test_the_rough_angle_is_as_near_as_it_says():
    angles = np.linspace(-math.pi, math.pi, 100001)
    x, y = np.cos(angles), np.sin(angles)
    found = np.zeros(x.size)
    angles_of(x, y, found)
    assert np.abs(found - np.arctan2(y, x)).max() < 0.5 * ROUGH

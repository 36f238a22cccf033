"""GIWT (1) and (2) against values worked by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from helpers import rig_of
from swarmscope.onboard.body import Body
from swarmscope.onboard.control.safe_speed import safe_distance, safe_sector, safe_speed

RIG = rig_of(Body(v_max_mps=0.5, a_max_mps2=2.0))._replace(footprint=0.3)
"""With 0.3 m for r_protect."""


def speed(ranges, heading=0.0, dt=0.2):
    return safe_speed(np.asarray(ranges, np.float32), RIG, heading, dt)


def scan(value=np.inf, **at):
    ranges = np.full(360, value)
    for degrees, s in at.items():
        ranges[180 + int(degrees.removeprefix("at").replace("m", "-"))] = s
    return ranges


def test_the_sector_of_a_3_4_5_triangle():
    """r_protect 0.3 m and 0.4 m of way: r_safe 0.7 m, half the sector atan(3 / 4)."""
    r_safe, half = safe_sector(0.3, 0.5, 0.8)
    assert r_safe == pytest.approx(0.7)
    assert math.sin(half) == pytest.approx(0.6)
    assert safe_distance(0.0, r_safe, half) == pytest.approx(0.7)
    assert safe_distance(half, r_safe, half) == pytest.approx(0.7)
    assert safe_distance(math.pi / 2, r_safe, half) == pytest.approx(0.42)
    assert safe_distance(-math.pi / 2, r_safe, half) == pytest.approx(0.42)
    assert safe_distance(math.radians(50.0), r_safe, half) == pytest.approx(0.42 / math.sin(math.radians(50.0)))


def test_a_robot_that_cannot_move_needs_its_own_disc():
    assert safe_sector(0.3, 0.5, 0.0) == pytest.approx((0.3, math.pi / 2))


def test_hand_worked_speeds():
    """l(0) = 0.4 m here: 0.01 m of slack allows sqrt(2 * 2 * 0.01) = 0.2 m/s, 60 degrees off twice that."""
    assert speed(scan(at0=0.41)) == pytest.approx(0.2, abs=1e-6)
    assert speed(scan(at60=0.41)) == pytest.approx(0.4, abs=1e-5)
    assert speed(scan(at0=0.4225)) == pytest.approx(0.3, abs=1e-6)
    assert speed(scan(at0=0.4625)) == 0.5
    assert speed(scan()) == 0.5


def test_nothing_may_be_inside_the_zone():
    assert speed(scan(at0=0.39)) == 0.0
    assert speed(scan(at90=0.1)) == 0.5
    assert speed(scan(at89=0.37)) == 0.0
    assert speed(scan(at100=0.2)) == 0.5


def test_an_invalid_beam_ahead_stops():
    assert speed(scan(at20=math.nan)) == 0.0
    assert speed(scan(at120=math.nan)) == 0.5


@given(st.integers(-180, 179), st.integers(-180, 179), st.floats(0.3, 0.6))
def test_only_the_angle_between_return_and_heading_matters(beam, turn, s):
    ranges = scan()
    ranges[180 + beam] = s
    assert speed(np.roll(ranges, turn), math.radians(turn)) == pytest.approx(speed(ranges), abs=1e-3)


@given(st.floats(0.3, 0.5), st.floats(0.0, 0.1), st.integers(-80, 80))
def test_a_nearer_return_never_allows_more(s, closer, beam):
    assert speed(scan(**{f"at{beam}".replace("-", "m"): s - closer})) <= speed(
        scan(**{f"at{beam}".replace("-", "m"): s})
    )

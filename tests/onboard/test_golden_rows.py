"""The golden rows of the published documents, as we read them (readings 1, 7-9, 11)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swarmscope.onboard.body import Body, protection_model
from swarmscope.onboard.deciding.fields import (
    following_probability,
    fuse,
    interaction_force,
    left_probability,
    neighbour_weight,
)
from swarmscope.onboard.perception.areas import normalise, passable_distance, quadrant_area

ALPHA_HALF = math.radians(36.0)
TABLE_II = {
    "R3": [[54, 1.62], [83, 1.53], [128, 1.78], [177, 1.55], [231, 1.89], [282, 1.55], [302, 1.58], [359, 1.18]],
    "R2": [[15, 1.60], [43, 1.67], [117, 1.24], [179, 1.83], [285, 1.03], [341, 1.77]],
    "R4": [[8, 1.78], [109, 1.17], [176, 1.85], [237, 1.27], [300, 1.69], [329, 1.62]],
    "R1": [[54, 1.17], [102, 1.44], [134, 1.39], [275, 1.89], [350, 1.47], [354, 1.47]],
    "R5": [[6, 1.28], [90, 1.84], [130, 1.65], [162, 1.76], [270, 1.17], [319, 1.76]],
}


def table(name):
    rows = np.array(TABLE_II[name])
    return np.radians(rows[:, 0]), rows[:, 1].copy(), len(rows)


def passable(name, chords):
    features = table(name)
    return (
        passable_distance(*features, 0.0, ALPHA_HALF, chords),
        passable_distance(*features, -ALPHA_HALF, 0.0, chords),
    )


def test_simulated_robot_has_the_published_protection_model():
    p = protection_model(Body())
    assert p.r == pytest.approx(0.30, abs=1e-9)
    assert p.l_th == pytest.approx(0.60, abs=1e-9)
    assert math.degrees(p.alpha) == pytest.approx(60.0, abs=1e-9)
    assert p.sigma_a == pytest.approx(0.90, abs=1e-9)


def test_real_robot_has_the_published_protection_model():
    body = Body(radius_m=0.43, half_width_m=0.29, v_max_mps=0.5, a_max_mps2=4.0, sensor_delay_s=0.0575)
    p = protection_model(body)
    assert p.r == pytest.approx(0.49, abs=1e-9)
    assert p.l_th == pytest.approx(0.83, abs=0.005)
    assert math.degrees(p.alpha) == pytest.approx(72.6, abs=0.05)
    assert p.sigma_a == pytest.approx(1.10, abs=1e-9)


def test_threshold_of_table_ii_is_1_54():
    body = Body(radius_m=0.43, half_width_m=0.29, v_max_mps=0.5, a_max_mps2=4.0, sensor_delay_s=0.0575)
    assert normalise(protection_model(body).w_n, 5.0) == pytest.approx(1.54, abs=0.002)


def test_own_probability_of_r3():
    features = table("R3")
    h, q = ALPHA_HALF, math.pi / 2
    areas = [quadrant_area(*features, *span, True) for span in ((0, h), (-h, 0), (h, q), (-q, -h))]
    assert left_probability(*areas, 0.0) == pytest.approx(0.5042, abs=5e-5)


def test_following_probability_of_r2():
    x_1, x_2 = passable("R2", False)
    assert x_1 == pytest.approx(1.638, abs=1e-3)
    assert x_2 == pytest.approx(1.770, abs=1e-9)
    assert following_probability(x_1, x_2, 1.54, True) == pytest.approx(0.581, abs=5e-4)


def test_following_probability_of_r4():
    assert following_probability(*passable("R4", True), 1.54, False) == pytest.approx(0.4137, abs=5e-5)


@pytest.mark.parametrize(
    ("name", "printed", "ours"),
    [("R1", 0.395, (0.4939, 0.5061, 0.4363, 0.5637)), ("R5", 0.414, (0.5022, 0.4978, 0.4580, 0.5420))],
)
def test_r1_and_r5_of_table_ii_are_not_reproduced(name, printed, ours):
    """By none of our rules: borders linear or on the chords, neighbour on the left or on the right."""
    found = [
        following_probability(*passable(name, chords), 1.54, left) for chords in (False, True) for left in (True, False)
    ]
    assert found == pytest.approx(ours, abs=5e-5)
    assert min(abs(value - printed) for value in found) > 0.04


def test_fusion_of_table_ii():
    p = np.array([0.395, 0.581, 0.403, 0.414])
    f = np.array([0.236, 0.279, 0.266, 0.247])
    assert fuse(0.504, float(p @ f), float(f.sum())) == pytest.approx(0.478, abs=5e-4)


def test_weight_by_adaboost():
    assert neighbour_weight(0.245, 0.446) == pytest.approx(0.193, abs=5e-4)


def test_largest_attraction():
    r = np.linspace(0.9, 9.0, 20001)
    f = np.array([interaction_force(d, 0.9, 1.0) for d in r])
    assert f.max() == pytest.approx(0.180, abs=5e-4)
    assert r[f.argmax()] / 0.9 == pytest.approx(1.477, abs=2e-3)
    assert interaction_force(0.9, 0.9, 1.0) == pytest.approx(0.0, abs=1e-12)

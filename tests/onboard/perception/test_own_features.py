"""Features of a robot before an obstacle: as SFM-MAS Table II has them, with a minimum ahead that is below l_th."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import circles_world, make_sensor, one_robot, rig_of, scan_at
from swarmscope.onboard.body import Body
from swarmscope.onboard.perception.features import MASK_ALL, MASK_MAXIMA, UNMASKED
from swarmscope.onboard.planners import load_planner
from swarmscope.onboard.sensor import all_round
from swarmscope.onboard.tick import own_features

REAL = Body(radius_m=0.43, half_width_m=0.29, v_max_mps=0.5, a_max_mps2=4.0, sensor_delay_s=0.0575)
"""The robots of Table II."""
L_TH = 0.83
WORLD = circles_world([(1.2, 0.1, 0.75), (2.4, 1.8, 0.4), (-0.6, 2.6, 0.5), (-2.6, -0.4, 0.5), (0.3, -2.2, 0.4)])
"""Something wide 0.45 m ahead and trees about 2 m away."""


def told(mask, sensor=None, **options):
    """The features of that place as {degrees: m}."""
    rig = rig_of(REAL, sensor, feature_mask=mask, **options)
    rows = one_robot(rig)
    whole = scan_at(WORLD, rig_of(REAL))
    rows.scan[:] = whole if sensor is None else whole[sensor.first :][: sensor.field]
    rows.view.masked[:] = rows.view.scan
    rows.shared["view_first"], rows.shared["view_last"] = rig.sensor.first, rig.sensor.first + rig.sensor.field - 1
    count = own_features(rows.view)
    angles, distances = rows.view.own.angles[:count], rows.view.own.distances[:count]
    return {round(math.degrees(a)): round(float(d), 2) for a, d in zip(angles, distances, strict=True)}


def ahead(features):
    return {a: d for a, d in features.items() if min(a, 360 - a) <= 30}


@pytest.mark.parametrize("mask", [MASK_MAXIMA, UNMASKED])
def test_the_obstacle_ahead_is_a_feature(mask):
    found = ahead(told(mask))
    assert len(found) == 1
    assert 0.45 < next(iter(found.values())) < L_TH


def test_of_table_ii_every_robot_tells_as_many_near_features_as_far_ones():
    """Maxima and minima take turns; printed packages hold 10.1 features at alpha = 60 degrees, Table II 6 to 8."""
    found = told(UNMASKED)
    values = list(found.values())
    assert 6 <= len(values) <= 12
    turns = np.sign(np.diff([*values, values[0]]))
    assert (turns[1:] == -turns[:-1]).all()


def test_to_mask_minima_hides_the_obstacle_ahead():
    assert ahead(told(MASK_ALL)) == {}
    assert set(told(MASK_ALL)) <= set(told(MASK_MAXIMA)) <= set(told(UNMASKED))


def test_each_planner_masks_what_its_document_prints():
    masks = {name: load_planner(name).feature_mask for name in ("nav-scope", "nav-i", "giwt", "sfm-mas", "sfm-i")}
    assert masks == {
        "nav-scope": MASK_MAXIMA,
        "nav-i": MASK_MAXIMA,
        "giwt": MASK_MAXIMA,
        "sfm-mas": UNMASKED,
        "sfm-i": UNMASKED,
    }


@pytest.mark.parametrize("mask", [MASK_MAXIMA, UNMASKED, MASK_ALL])
def test_what_is_only_remembered_is_not_told(mask):
    found = told(mask, all_round(make_sensor(beams=121, fov=math.radians(120.0))))
    assert all(min(a, 360 - a) <= 60 for a in found)
    assert found or mask == MASK_ALL


def test_the_printed_filter_keeps_side_lobes_and_lets_values_fall_below_zero():
    """SFM-MAS says so of its filter; the main lobe alone is positive everywhere."""
    lobe, printed = rig_of(REAL), rig_of(REAL, printed_filter=True)
    assert (lobe.taps.size, printed.taps.size) == (73, 359)
    assert lobe.taps.min() >= 0.0 > printed.taps.min()
    assert printed.taps.sum() == pytest.approx(1.0, abs=1e-5)
    assert len(told(UNMASKED, printed_filter=True)) >= len(told(UNMASKED))

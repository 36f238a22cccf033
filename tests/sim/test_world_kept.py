"""The arrays of the last world are kept: the same ones for the same parts, new ones for any other."""

from __future__ import annotations

import numpy as np

from swarmscope.sim.world import WorldSpec, compile_world

CIRCLE = {"type": "circle", "center": [1.0, 2.0], "radius": 0.5}
BOUNDS = [0.0, 0.0, 4.0, 4.0]


def spec_of(*circles, bounds=BOUNDS):
    return WorldSpec.model_validate({"bounds": bounds, "obstacles": list(circles)})


def test_the_same_world_is_compiled_once():
    spec = spec_of(CIRCLE)
    assert compile_world(spec) is compile_world(spec)


def test_other_worlds_are_others_whatever_they_share():
    spec = spec_of(CIRCLE)
    first = compile_world(spec)
    wider = spec.model_copy(update={"bounds": (-2.0, 0.0, 4.0, 4.0)})
    assert compile_world(wider).bins.x0 == -2.0
    more = spec.model_copy(update={"obstacles": [*spec.obstacles, *spec_of(CIRCLE | {"radius": 0.7}).obstacles]})
    assert len(compile_world(more).circles) == 2
    spec.obstacles.append(more.obstacles[1])  # a list that is changed in place
    assert len(compile_world(spec).circles) == 2
    again = compile_world(spec_of(CIRCLE))
    assert again is not first
    np.testing.assert_array_equal(again.circles, first.circles)

"""One source: what a scenario leaves out is what the kernels' own tuples leave out, and every key says what it is."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from pydantic import BaseModel

from swarmscope.onboard.body import Body
from swarmscope.onboard.rig import Guarding, Safety, Sharing, make_rig
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.scenario import (
    FaultsModel,
    GuardModel,
    LidarModel,
    MapModel,
    NoiseModel,
    PlannerModel,
    RadioModel,
    RobotModel,
    SafetyModel,
    Scenario,
    TaskModel,
    WorldModel,
)
from swarmscope.scenarios.to_kernels import make_rig_of, make_setting
from swarmscope.sim.loop import Setting
from swarmscope.sim.state import Faults, Noise, Radio

MODELS = (
    Scenario, TaskModel, MapModel, WorldModel, PlannerModel, RobotModel, LidarModel, NoiseModel, RadioModel,
    FaultsModel, GuardModel, SafetyModel,
)  # fmt: skip
SHORTEST = Scenario(task=TaskModel(name="swap"), robots=2)


def test_the_defaults_of_a_scenario_are_those_of_the_kernels():
    setting = make_setting(SHORTEST, make_setup(SHORTEST))
    assert setting.noise == Noise()
    assert setting.radio == Radio()
    assert setting.faults == Faults()
    assert setting.rig.body == Body()
    plain = {field.name: field.default for field in dataclasses.fields(Setting)}
    for name in ("seed", "dt", "substeps", "limit_s"):
        assert getattr(setting, name) == plain[name], name


def test_the_rig_of_a_scenario_is_the_one_of_a_robot():
    rig = make_rig_of(SHORTEST)
    robot = make_rig(Body(), rig.sensor)
    for name in rig._fields:
        assert np.array_equal(getattr(rig, name), getattr(robot, name)), name


@pytest.mark.parametrize(
    ("model", "kernels"),
    [
        (RobotModel, Body()._asdict() | {"footprint": None}),
        (RadioModel, Radio()._asdict() | Sharing()._asdict()),
        (GuardModel, Guarding()._asdict()),
        (SafetyModel, Safety()._asdict()),
        (FaultsModel, Faults()._asdict()),
    ],
)
def test_each_default_of_the_schema_is_the_one_of_the_tuple(model, kernels):
    for name, field in model.model_fields.items():
        assert field.default == kernels[name], name


def test_noise_is_the_same_in_other_units():
    noise = NoiseModel()
    assert (noise.range_fraction, noise.dropout) == (Noise().range_fraction, Noise().dropout)
    assert math.radians(noise.bearing_deg) == Noise().bearing_rad
    assert math.radians(noise.compass_deg) == Noise().compass_rad
    assert set(NoiseModel.model_fields) == {name.replace("_rad", "_deg") for name in Noise._fields}


@pytest.mark.parametrize("model", MODELS)
def test_every_key_says_what_it_means(model):
    assert issubclass(model, BaseModel)
    for name, field in model.model_fields.items():
        assert field.description and field.description.endswith("."), name
        assert len(field.description) > 6, name

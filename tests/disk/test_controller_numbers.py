"""Numbers of controllers that a user sets: which are refused, before anything hangs or a guarantee is gone."""

import pytest

from swarmscope.disk import controllers
from swarmscope.errors import ConfigError


@pytest.mark.parametrize(
    ("name", "key", "value", "why"),
    [
        ("reactive", "gain", "1", "not between 0.001 and 0.999"),
        ("reactive", "stride", "0", "not between 0.05"),
        ("reactive", "horizon", "inf", "not between"),
        ("reactive", "again", "nan", "not between 0 and"),
        ("report", "obstacle_buffer", "-0.1", "not between 0 and"),
        ("report", "obstacle_buffer", "", "'' is not a number"),
        ("report", "nearest", "2", "not between 0 and 1"),
        ("report", "rim_buffer", "0.6", "not between 0 and 0.5"),
        ("navigation-function", "k", "nan", "not between"),
        ("navigation-function", "steer", "2", "not between 0 and 1"),
        ("planned", "tick", "0", "not between 1 and"),
        ("planned", "tick", "2.5", "'2.5' is not a whole number"),
    ],
)
def test_numbers_that_make_no_sense_are_refused(name, key, value, why):
    with pytest.raises(ConfigError, match=f"{name}.{key}: .*{why}"):
        controllers.find(name, {key: value})


@pytest.mark.parametrize("name", controllers.names())
def test_the_defaults_are_within_the_limits_and_limits_are_of_numbers_that_exist(name):
    kind = controllers.find(name)
    defaults = kind.params._asdict()
    assert controllers.find(name, defaults) == kind
    module = __import__(kind.create.__module__, fromlist=["LIMITS"])
    assert set(module.LIMITS) <= set(defaults)

"""Choices of a network, looked into: what it was given, its outputs, and how much it attended to whom."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")

from giwt_models import make_model
from swarmscope import simulate
from swarmscope.errors import ConfigError, InputFileError
from swarmscope.scenarios.read import parse_scenario
from swarmscope.viewing.key_points.again import key_points
from swarmscope.viewing.key_points.attention import Attention
from swarmscope.viewing.key_points.picture import key_points_png, most_moved
from swarmscope.viewing.run_data import load_run


def played(folder, planner, **keys):
    run = simulate("GIWT_2", planner=planner, seed=31003, limit_s=12.0, progress=False, **keys)
    found = load_run(run.save(folder / "run", pictures=False))
    return found, parse_scenario(run.scenario, "test")


@pytest.fixture(scope="module", params=["giwt", "giwt-gat"])
def run(request, tmp_path_factory):
    return played(tmp_path_factory.mktemp("run"), request.param)


@pytest.fixture(scope="module")
def points(run):
    return key_points(*run)


def test_there_is_one_for_every_choice_that_the_run_recorded(run, points):
    choices = run[0].trajectory.choices
    recorded = choices[[one.number for one in points]]
    assert len(points) >= 8 and max(len(one.heard) for one in points) >= 3
    # tick, robot, P of the robot alone, P_dir, side, how many were heard: to the bit.
    mine = [(one.tick, one.robot, one.p_self, one.p_left, one.side, len(one.heard)) for one in points]
    assert np.array_equal(recorded, np.array(mine))


def test_attention_sums_to_one_and_the_outputs_are_those_that_the_planner_used(points):
    for one in points:
        assert one.weights.shape == (1 + len(one.heard), 4)
        assert one.weights.sum(axis=0) == pytest.approx(1.0, abs=1e-6) and (one.weights > 0.0).all()
        assert one.weight.sum() == pytest.approx(1.0, abs=1e-6)
        both = np.exp(one.logits) / np.exp(one.logits).sum()
        assert one.outputs == pytest.approx(tuple(both), abs=1e-9) and sum(one.outputs) == 1.0
        assert one.side == (1 if one.p_left > 0.5 else -1)
        assert one.true_side in (-1, 0, 1)


def test_those_that_neighbours_moved_most_are_chosen_one_of_each_robot(points):
    chosen = most_moved(points, 3)
    assert len({one.robot for one in chosen}) == len(chosen) == 3
    assert [one.number for one in chosen] == sorted(one.number for one in chosen)
    least = min(abs(one.p_left - one.p_self) for one in chosen)
    others = [one for one in points if one.robot not in {c.robot for c in chosen} and one.heard and one.true_side]
    assert all(abs(one.p_left - one.p_self) <= least for one in others)


def test_they_are_drawn_the_same_each_time(run, points):
    png = key_points_png(run[0], most_moved(points, 3))
    assert png == key_points_png(run[0], most_moved(points, 3))
    assert np.asarray(Image.open(io.BytesIO(png)).convert("L")).std() > 10.0


def test_networks_without_attention_are_told(tmp_path):
    with pytest.raises(ConfigError, match="giwt-sage': has no attention weights; 'giwt' and 'giwt-gat'"):
        key_points(*played(tmp_path, "giwt-sage"))
    with pytest.raises(InputFileError, match="has 0 Softmax"):
        Attention(make_model(tmp_path / "model"))


def test_a_run_that_comes_out_otherwise_is_told(run):
    found, scenario = run
    other = scenario.model_copy(update={"seed": scenario.seed + 1})
    with pytest.raises(InputFileError, match="no longer comes out the same"):
        key_points(found, other)

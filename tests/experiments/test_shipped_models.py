"""The networks in the package choose sides of a swarm in simulation."""

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("onnxruntime")

from swarmscope.judging.run import figures, play
from swarmscope.scenarios.read import parse_scenario

MODELS = Path(__file__).parents[2] / "src" / "swarmscope" / "data" / "models"
PLANNERS = {"giwt": "giwt", "giwt_gat": "gat", "giwt_sage": "graphsage", "giwt_cnn": "cnn"}


@pytest.mark.parametrize("folder", PLANNERS)
def test_the_card_says_what_the_network_was_made_of(folder):
    card = json.loads((MODELS / folder / "model.json").read_text())
    assert card["network"] == PLANNERS[folder]
    assert card["training"]["config"]["network"] == card["network"]
    assert card["scores"]["split"] == "test" and len(card["scores"]["sets"]) == 6
    mine = [k for k, row in enumerate(card["scores"]["sets"]["A-I"]["networks"]) if row["label"] == card["network"]]
    for row in card["scores"]["sets"].values():
        score = row["networks"][mine[0]]["accuracy"]
        assert 0.75 < score["low"] < score["value"] < score["high"] < 1.0
        assert row["majority"] < 0.6


@pytest.mark.parametrize("planner", ["giwt", "giwt-gat", "giwt-sage", "giwt-cnn"])
def test_a_swarm_arrives_without_a_collision(planner):
    keys = {"task": {"name": "GIWT_2"}, "planner": {"name": planner}, "seed": 31000, "judge_sides": True}
    outcome = play(parse_scenario(keys | {"record_scans": "no"}, "test"), any_angle=False)
    values = figures(outcome)
    assert values["arrival_rate"] == 1.0 and values["collisions"] == 0
    choices = outcome.trace.choices
    assert len(choices) > 0 and np.isfinite(choices["p_left"]).any()
    assert (choices["heard"] > 0).any() == (planner != "giwt-cnn")

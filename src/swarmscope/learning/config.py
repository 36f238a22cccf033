"""What a training is made of: one YAML file, validated."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from swarmscope.errors import ConfigError, InputFileError
from swarmscope.learning.generate import DRIVEN, PLACED, parse_set
from swarmscope.onboard.network.model import VIEWS_M
from swarmscope.scenarios.scenario import NUMBER
from swarmscope.texts import read_yaml

FOLDER = Path(__file__).parent.parent / "data" / "training"
Count = Annotated[int, Field(ge=1, le=10**9), NUMBER]
Channels = Annotated[int, Field(ge=1, le=4096), NUMBER]
NotNegative = Annotated[float, Field(ge=0.0, le=1e6), NUMBER]
Positive = Annotated[float, Field(gt=0.0, le=1e6), NUMBER]


class TrainingConfig(BaseModel):
    """One training, complete but for the folders of its data and its results."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    network: Literal["giwt", "gat", "graphsage", "cnn"] = "giwt"
    sets: Annotated[list[str], Field(min_length=1)] = [*PLACED, *DRIVEN]
    """Sets of the data folder, by name."""
    channels: tuple[Channels, Channels, Channels] = (16, 32, 64)
    stem_stride: Literal[1, 2] = 2
    use_gain: bool = True
    use_position: bool = True
    as_printed: bool = False
    """giwt: nothing beyond (4)-(9), see learning/models.py."""
    dropout: Annotated[float, Field(ge=0.0, lt=1.0), NUMBER] = 0.0
    view_m: Annotated[float, Field(ge=VIEWS_M[0], le=VIEWS_M[1]), NUMBER] = 5.0
    """Radius of the pictures: the range of the sensor; the document has 2.5 m."""
    shorter: Annotated[float, Field(ge=0.0, le=1.0), NUMBER] = 0.25
    """Share of the training samples in which robots see less far, 1 m to view_m: for sensors of a shorter range."""
    epochs: Count = 20
    samples_per_epoch: Count = 60_000
    """Drawn anew for every epoch; all of the training data if it holds fewer."""
    validation_samples: Count = 20_000
    batch: Annotated[int, Field(ge=2, le=10**6), NUMBER] = 256
    learning_rate: Positive = 1e-3
    weight_decay: NotNegative = 1e-2
    warm_up: NotNegative = 0.5
    """Epochs until the full learning rate; afterwards it falls along a cosine."""
    detour_power: NotNegative = 0.0
    """Samples weigh (detour / 1 m) to this power, between 0.1 and 10: 0 counts errors, 1 counts metres."""
    patience: Count = 6
    """Stop after so many epochs without a lower validation loss."""
    precision: Literal["auto", "float32", "bfloat16"] = "auto"
    """auto: bfloat16 where the processor computes in it, float32 elsewhere; parameters are always float32."""
    seed: Annotated[int, Field(ge=0, lt=2**31), NUMBER] = 0
    threads: Annotated[int, Field(ge=0, le=1024), NUMBER] = 0
    """Of the CPU, 0 for all."""


def read_config(name: str, changes: dict[str, Any] | None = None) -> TrainingConfig:
    """Return the configuration ``name``: a packaged one (`names`) or a YAML file, with ``changes`` on top."""
    path = FOLDER / f"{name}.yaml" if name in names() else Path(name)
    if not path.exists():
        raise InputFileError(path, f"cannot be read (there is none); packaged ones are {', '.join(names())}")
    values = read_yaml(path) or {}
    if not isinstance(values, dict):
        raise ConfigError(str(path), "a training is a mapping of keys to values")
    return parse_config(values | (changes or {}), str(path))


def parse_config(values: dict[str, Any], where: str) -> TrainingConfig:
    """Return the configuration in ``values``; a ConfigError names place and problem."""
    try:
        config = TrainingConfig.model_validate(values)
    except ValidationError as error:
        problem = error.errors()[0]
        key = ".".join(str(part) for part in problem["loc"]) or "(top)"
        what = f"unknown key; valid are {', '.join(TrainingConfig.model_fields)}"
        why = what if problem["type"] == "extra_forbidden" else str(problem["msg"]).removeprefix("Value error, ")
        raise ConfigError(f"{where}: {key}", why) from None
    for name in config.sets:
        parse_set(name)
    return config


def names() -> list[str]:
    """Return the packaged configurations."""
    return sorted(path.stem for path in FOLDER.glob("*.yaml"))

"""GIWT's networks trained from several seeds: how much of a difference between them is the seed's.

swarmscope giwt data --set-of placed --samples 20000
python benchmarks/giwt_seeds.py --seeds 0-4
python benchmarks/giwt_seeds.py --seeds 0-0 --radii 1,2,2.5,3,4,5    # one network per radius (their Fig. 6)

For each seed a CNN is trained, and from its encoder every other network and ablation (`VARIANTS`), in a small setting
(`SMALL`). Accuracy is the mean over the sets on test maps; intervals are Student's over the seeds, of differences over
pairs with the same seed. May be stopped at any moment: the same command goes on.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import Progress
from scipy.stats import t as student

from swarmscope.learning.config import parse_config, read_config
from swarmscope.learning.evaluate import judge, open_trained, read_test
from swarmscope.learning.generate import PLACED
from swarmscope.learning.train import train

SMALL = {
    "sets": PLACED, "channels": (8, 16, 32), "epochs": 4, "samples_per_epoch": 15_000, "validation_samples": 6_000,
}  # fmt: skip
VARIANTS: dict[str, dict[str, Any]] = {
    "CNN": {"network": "cnn"},
    "GraphSAGE": {"network": "graphsage"},
    "GAT": {"network": "gat"},
    "GIWT": {"network": "giwt"},
    "GIWT without beta": {"network": "giwt", "use_gain": False},
    "GIWT without positions": {"network": "giwt", "use_position": False},
    "GIWT as printed": {"network": "giwt", "as_printed": True},
}
NAMES = (*VARIANTS, "CNN at 2.5 m", "GIWT at 2.5 m", "GIWT as printed at 2.5 m")
"""A network whose pictures show less than 5 m says so; the others are trained to see less far as well."""
BY_RADIUS = ("CNN", "GIWT")
COMPARED = (("GIWT", VARIANTS.keys()), ("GIWT at 2.5 m", {"CNN at 2.5 m", "GIWT as printed at 2.5 m"}))


def at_radius(network: str, radius_m: float) -> str:
    """Return the name of a network whose pictures show a radius; that of 5 m is the usual one."""
    return network if radius_m == 5.0 else f"{network} at {radius_m:g} m"


def keys_of(name: str) -> dict[str, Any]:
    """Return what a network's configuration has instead of the usual."""
    kind, _, radius = name.removesuffix(" m").partition(" at ")
    return VARIANTS[kind] | ({"view_m": float(radius), "shorter": 0.0} if radius else {})


def trained(name: str, seed: int, data: Path, out: Path, note: Callable[[str], None]) -> Path:
    """Return the folder of a network trained from a seed; trains what is missing of it.

    Every network but the CNN begins with the encoder of the CNN of its radius.
    """
    config = parse_config(read_config("cpu").model_dump() | SMALL | keys_of(name) | {"seed": seed}, name)
    folder = out / f"{name.lower().replace(' ', '-')}-{seed}"
    first = at_radius("CNN", config.view_m)
    init = None if name == first else trained(first, seed, data, out, note) / "best.safetensors"
    train(config, data, folder, init, lambda epoch, done, steps, words: note(f"{name}, seed {seed}: {words}"))
    return folder


def accuracy(folder: Path, shards: dict[str, Any]) -> float:
    """Return the mean over the sets of the share of sides that are the expert's."""
    network = open_trained(folder)
    return float(np.mean([judge(network, shard).hit.mean() for shard in shards.values()]))


def interval(values: np.ndarray) -> str:
    """Return the mean in percent with Student's 95 % interval."""
    mean = 100.0 * values.mean()
    if len(values) < 2:
        return f"{mean:+.2f}"
    half = 100.0 * values.std(ddof=1) / np.sqrt(len(values)) * student.ppf(0.975, len(values) - 1)
    return f"{mean:.2f} ({mean - half:.2f} to {mean + half:.2f})"


def print_variants(seeds: int, found: dict[str, list[float]]) -> None:
    """Print the networks and ablations, one a line."""
    print(f"| {seeds} seeds | accuracy on test maps, % | " + " | ".join(f"minus {a}" for a, _ in COMPARED) + " |")
    print("|---" * (2 + len(COMPARED)) + "|")
    for name, values in found.items():
        own = np.array(values)
        cells = [interval(own - found[base]) if name in others and name != base else "" for base, others in COMPARED]
        print(f"| {name} | {interval(own)} | " + " | ".join(cells) + " |")


def print_radii(radii: list[float], found: dict[str, list[float]]) -> None:
    """Print the networks of each radius, and what neighbours add."""
    print("| one network per radius | " + " | ".join(f"{radius:g} m" for radius in radii) + " |")
    print("|---" * (1 + len(radii)) + "|")
    values = {kind: [np.array(found[at_radius(kind, radius)]) for radius in radii] for kind in BY_RADIUS}
    for kind in BY_RADIUS:
        print(f"| {kind} | " + " | ".join(interval(one) for one in values[kind]) + " |")
    gains = [interval(many - one) for one, many in zip(*(values[kind] for kind in BY_RADIUS), strict=True)]
    print("| what neighbours add | " + " | ".join(gains) + " |")


def main() -> None:
    """Parse the options, train, score, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="0-4", help="first-last")
    parser.add_argument("--radii", help="one CNN and one GIWT for each of these radii [m] instead, as 1,2,5")
    parser.add_argument("--data", type=Path, default=Path("runs/giwt/data"))
    parser.add_argument("--out", type=Path, default=Path("runs/giwt/seeds"))
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    shards = read_test(options.data, PLACED)
    radii = [float(radius) for radius in (options.radii or "").split(",") if radius]
    names = [at_radius(kind, radius) for radius in radii for kind in BY_RADIUS] or list(NAMES)
    found: dict[str, list[float]] = {name: [] for name in names}
    with Progress() as bar:
        job = bar.add_task("begins", total=len(names) * len(seeds))

        def note(words: str) -> None:
            bar.update(job, description=words)

        for seed in seeds:
            for name in names:
                folder = trained(name, seed, options.data, options.out, note)
                found[name].append(accuracy(folder, shards))
                bar.advance(job)
    if radii:
        print_radii(radii, found)
    else:
        print_variants(len(seeds), found)


if __name__ == "__main__":
    main()

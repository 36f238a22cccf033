"""``swarmscope giwt``: expert data, training, evaluation and export of the networks that pick a side."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from swarmscope.cli._console import PlainConsole
from swarmscope.errors import ConfigError, MissingExtraError
from swarmscope.learning.generate import DRIVEN, PLACED, generate, totals, verify

RADII_SAMPLES = 12_000
"""Samples on which networks are scored for every radius."""


def data_command(folder: Path, sets: Sequence[str], samples: int, workers: int | None, check: bool) -> None:
    """Bring a data folder to ``samples`` samples for each set, or check what is there; print a table."""
    if check:
        manifest = verify(folder)
    else:
        with _bar() as bar:
            jobs: dict[str, Any] = {}

            def report(name: str, done: int, wanted: int) -> None:
                if name not in jobs:
                    jobs[name] = bar.add_task(name, total=wanted, note="")
                bar.update(jobs[name], completed=min(done, wanted), note=f"{done} of {wanted} samples")

            manifest = generate(folder, expand(sets), samples, workers, report)
    table = Table(title=f"expert data in {folder}")
    columns = (
        "samples", "train", "validation", "test", "left", "maps", "looked_at", "unreachable", "nothing_ahead", "tie",
    )  # fmt: skip
    for column in ("set", *columns, "neighbours"):
        table.add_column(column, justify="right")
    for name, row in totals(manifest).items():
        table.add_row(name, *(str(row[c]) for c in columns), f"{row['neighbours'] / row['samples']:.2f}")
    PlainConsole(width=None if sys.stdout.isatty() else 150).print(table)
    if check:
        print("all shards are there and have the checksums of the manifest")


def expand(sets: Sequence[str]) -> list[str]:
    """Return the sets that a list of names and groups stands for."""
    found: list[str] = []
    for name in sets:
        found += {"placed": PLACED, "driven": DRIVEN, "all": PLACED + DRIVEN}.get(name, [name])
    return list(dict.fromkeys(found))


def train_command(config: str, data: Path, out: Path | None, init: Path | None, changes: Sequence[str]) -> None:
    """Train a network, or go on training it."""
    from swarmscope.learning.config import read_config

    _need("torch", "torch_geometric", "safetensors", "tensorboard")
    from swarmscope.learning.train import train

    chosen = read_config(config, read_changes(changes))
    place = out or Path("runs") / "giwt" / chosen.network
    with _bar() as bar:
        job = bar.add_task(chosen.network, total=None, note="reads data")

        def report(epoch: int, done: int, steps: int, note: str) -> None:
            bar.update(
                job, total=chosen.epochs * steps, completed=epoch * steps + done,
                note=f"epoch {epoch + 1} of {chosen.epochs}: {note}",
            )  # fmt: skip
            if note.startswith("validation"):
                bar.console.print(f"epoch {epoch + 1}: {note}", highlight=False)

        history = train(chosen, data, place, init, report)
    best = min(history, key=lambda row: row["validation_loss"])
    print(
        f"{chosen.network}: best of {len(history)} epochs is {best['epoch']}: validation loss "
        f"{best['validation_loss']:.4f}, accuracy {100 * best['validation_accuracy']:.2f} %"
    )
    print(place / "best.safetensors")


def eval_command(
    runs: Sequence[Path],
    data: Path,
    sets: Sequence[str],
    split: str,
    radii: Sequence[float],
    out: Path | None,
    pictures: Path | None,
) -> None:
    """Score trained networks on every set and compare the first with the others."""
    _need("torch", "torch_geometric", "safetensors")
    from swarmscope.learning.evaluate import (
        ahead_of,
        coin_regret,
        data_key,
        judge,
        lost_on_the_radio,
        majority,
        open_trained,
        read_test,
        regret,
        share,
    )
    from swarmscope.learning.records import SPLITS

    if split not in SPLITS:
        raise ConfigError("--split", f"'{split}' is none of {', '.join(SPLITS)}")
    networks = _told_apart([open_trained(path) for path in runs])
    shards = read_test(data, expand(sets), split)
    result: dict[str, Any] = {"data": data_key(data, list(shards)), "split": split, "sets": {}}
    everything: list[list[Any]] = [[] for _ in networks]
    table = Table(title=f"accuracy on {split} maps, % (95 % interval over maps)")
    for column in ("set", "samples", "majority", *(n.label for n in networks)):
        table.add_column(column, justify="right")
    with _bar() as bar:
        job = bar.add_task("eval", total=len(networks) * sum(s.samples for s in shards.values()), note="")
        for name, shard in shards.items():
            verdicts = [judge(one, shard, lambda done: bar.advance(job, done)) for one in networks]
            rows = []
            for one, verdict in zip(networks, verdicts, strict=True):
                row = {"label": one.label, "checkpoint": str(one.path), "accuracy": share(verdict.hit, verdict.map)}
                row |= {"regret_m": regret(verdict), "first_ahead": ahead_of(verdicts[0], verdict)}
                row |= {"lost_on_the_radio": lost_on_the_radio(verdict)}
                rows.append({k: v._asdict() if hasattr(v, "_asdict") else v for k, v in row.items()})
            for kept, verdict in zip(everything, verdicts, strict=True):
                kept.append(verdict)
            most = majority(shard)
            about = {"samples": shard.samples, "majority": most, "coin_regret_m": coin_regret(shard)}
            result["sets"][name] = about | {"networks": rows}
            table.add_row(name, str(shard.samples), f"{100 * most:.1f}", *(_words(r["accuracy"]) for r in rows))
            if out is not None:
                _save(out, result)
    means = [_mean(result, k) for k in range(len(networks))]
    table.add_row("mean", "", "", *(f"{100 * value:.2f}" for value in means))
    joined = [[np.concatenate([getattr(v, part) for v in kept]) for part in ("hit", "map")] for kept in everything]
    result["whole"] = [share(hit, maps)._asdict() for hit, maps in joined]
    result["mean_accuracy"] = {one.label: value for one, value in zip(networks, means, strict=True)}
    console = PlainConsole(width=None if sys.stdout.isatty() else 170)
    console.print(table)
    console.print(_difference_table(result, [one.label for one in networks]))
    console.print(_regret_table(result, [one.label for one in networks]))
    scores = _at_radii(networks, shards, radii, console) if radii else {}
    result["radii"] = {label: {f"{r:g}": s._asdict() for r, s in row.items()} for label, row in scores.items()}
    if out is not None:
        _save(out, result)
        print(out)
    if pictures is not None:
        _draw(pictures, networks, shards, scores)


def _told_apart(networks: list[Any]) -> list[Any]:
    """Return networks with labels of their own: those that share one get the name of their folder."""
    labels = [one.label for one in networks]
    same = [labels.count(one.label) > 1 for one in networks]
    return [
        one._replace(label=f"{one.label} ({one.path.parent.name})") if twice else one
        for one, twice in zip(networks, same, strict=True)
    ]


def _at_radii(networks: Sequence[Any], shards: dict[str, Any], radii: Sequence[float], console: Console) -> Any:
    """Score networks with robots that see less far, on some samples of all sets; print a table."""
    from swarmscope.learning.evaluate import judge, share
    from swarmscope.learning.records import concatenate, some

    whole = some(concatenate(list(shards.values())), RADII_SAMPLES)
    table = Table(title=f"accuracy on {whole.samples} samples of all sets by perception radius, % (95 %)")
    table.add_column("radius", justify="right")
    for one in networks:
        table.add_column(one.label, justify="right")
    scores: dict[str, dict[float, Any]] = {one.label: {} for one in networks}
    with _bar() as bar:
        job = bar.add_task("radii", total=len(networks) * len(radii) * whole.samples, note="")
        for radius in radii:
            for one in networks:
                verdict = judge(one, whole, lambda done: bar.advance(job, done), radius)
                scores[one.label][radius] = share(verdict.hit, verdict.map)
            table.add_row(f"{radius:g} m", *(_words(scores[one.label][radius]._asdict()) for one in networks))
    console.print(table)
    return scores


def _draw(folder: Path, networks: Sequence[Any], shards: dict[str, Any], scores: dict[str, Any]) -> None:
    """Draw the first network's layers, and accuracy against radius where it was asked for."""
    from swarmscope.learning.figures import radius_png, tsne_png
    from swarmscope.learning.records import concatenate, write_atomically

    with _bar() as bar:
        bar.add_task("pictures", total=None, note="")
        whole = concatenate(list(shards.values()))
        contents = {"layers.png": tsne_png(networks[0], whole)}
        if scores:
            contents["radius.png"] = radius_png(scores)
    for name, data in contents.items():
        write_atomically(folder / name, data)
        print(folder / name)


def ceiling_command(data: Path, sets: Sequence[str], view_m: float) -> None:
    """Print how often near twins contradict each other."""
    _need("sklearn")
    from swarmscope.learning.ceiling import contradictions
    from swarmscope.learning.evaluate import read_test

    names = expand(sets)
    training, test = (read_test(data, names, split) for split in ("train", "test"))
    table = Table(title=f"pairs of test and training samples that look alike within {view_m:g} m: sides that differ, %")
    table.add_column("set", justify="right")
    with _bar() as bar:
        job = bar.add_task("twins", total=len(names), note="")
        for name in names:
            rows = contradictions(training[name], test[name], view_m)
            if len(table.columns) == 1:
                for row in rows:
                    table.add_column(f"nearest {100 * row.share:g} %", justify="right")
            table.add_row(name, *(f"{100 * row.contradict:.1f} (< {row.difference_m:.2f} m)" for row in rows))
            bar.advance(job)
    PlainConsole(width=None if sys.stdout.isatty() else 170).print(table)


def export_command(run: Path, out: Path, scores: Path | None) -> None:
    """Write what a robot runs."""
    _need("torch", "torch_geometric", "safetensors", "onnx", "onnxruntime")
    from swarmscope.learning.export import export
    from swarmscope.learning.train import BEST

    card = {} if scores is None else {"scores": json.loads(scores.read_text(encoding="utf-8"))}
    difference = export(run / BEST if run.is_dir() else run, out, card)
    print(f"{out}: ONNX Runtime and PyTorch differ by at most {difference:.1e}")


def read_changes(changes: Sequence[str]) -> dict[str, Any]:
    """Return KEY=VALUE words as a mapping, values read as YAML."""
    found: dict[str, Any] = {}
    for text in changes:
        key, equals, value = text.partition("=")
        if not equals or not key:
            raise ConfigError("--set", f"'{text}' is not KEY=VALUE")
        try:
            found[key] = yaml.safe_load(value)
        except yaml.YAMLError:
            raise ConfigError("--set", f"'{value}' is no value") from None
        if isinstance(found[key], str):
            with suppress(ValueError):
                found[key] = float(found[key])  # YAML 1.1 takes 1e-3 for text
    return found


def _need(*packages: str) -> None:
    """Raise MissingExtraError unless the packages of the extra are installed."""
    from importlib.util import find_spec

    if not all(find_spec(name) for name in packages):
        raise MissingExtraError("swarmscope giwt", "learn")


def _save(out: Path, result: dict[str, Any]) -> None:
    from swarmscope.learning.records import write_atomically

    write_atomically(out, (json.dumps(result, indent=1) + "\n").encode())


def _words(score: Any) -> str:
    return f"{100 * score['value']:.2f} ({100 * score['low']:.1f}-{100 * score['high']:.1f})"


def _mean(result: dict[str, Any], k: int) -> float:
    values = [entry["networks"][k]["accuracy"]["value"] for entry in result["sets"].values()]
    return float(sum(values) / len(values))


def _difference_table(result: dict[str, Any], labels: list[str]) -> Table:
    table = Table(title=f"{labels[0]} minus the others, and its features exact minus in bytes: percentage points")
    for column in ("set", *labels[1:], "bytes"):
        table.add_column(column, justify="right")
    for name, entry in result["sets"].items():
        rows = entry["networks"]
        apart = [*(row["first_ahead"] for row in rows[1:]), rows[0]["lost_on_the_radio"]]
        words = (tuple(100 * score[key] for key in ("value", "low", "high")) for score in apart)
        table.add_row(name, *(f"{value:+.2f} ({low:+.2f}..{high:+.2f})" for value, low, high in words))
    return table


def _regret_table(result: dict[str, Any], labels: list[str]) -> Table:
    table = Table(title="detours because of wrong sides, m a choice (share of a coin's detours saved)")
    for column in ("set", "coin", *labels):
        table.add_column(column, justify="right")
    for name, entry in result["sets"].items():
        coin = entry["coin_regret_m"]
        lost = [row["regret_m"]["value"] for row in entry["networks"]]
        table.add_row(name, f"{coin:.3f}", *(f"{value:.3f} ({100 * (1 - value / coin):.1f} %)" for value in lost))
    return table


@contextmanager
def _bar() -> Iterator[Progress]:
    columns = (
        TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[note]}"), TimeElapsedColumn(),
        TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        yield bar

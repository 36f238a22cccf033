"""Writes docs/fidelity.md from docs/fidelity.yaml and the lines at which symbols stand: python docs/fidelity.py"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import yaml

PAGE = Path(__file__).with_suffix(".md")
SOURCE = Path(__file__).with_suffix(".yaml")
ROOT = PAGE.parents[1]
PACKAGE = "src/swarmscope"
BESIDE = ("docs", "tests", "benchmarks", "examples")
"""Folders beside the package; every other path is below it."""
STATES = {
    "faithful": "does what is printed. A table or a figure: we make the same one, whatever its numbers are here",
    "reading": "the print is open or contradicts itself; we took the reading that the remark names, and test it",
    "deviates": "does something else by default; the next columns say how to get the print back, and what it changes",
    "partial": "a part of it is here",
    "missing": "not here",
}
PRINTED = "printed"
"""A preset of planners, instead of single keys."""
NO_KEY = "No key: "
"""How the remark of a deviation without keys begins to say why."""
UNMEASURED = "not measured"

HEAD = """# The four documents, item by item

*Made by `python docs/fidelity.py` from `docs/fidelity.yaml`: change that instead, and run it after lines have moved.*

One row for each equation, step of an algorithm, table and figure of the four documents of
[references.md](references.md). What differs most, and why, is told in one place in
[theory.md](theory.md#where-we-differ-from-the-paper-and-why).

| state | meaning |
|---|---|
{states}

**Restored by.** Keys of a scenario file ([scenario.md](scenario.md)); `planner.params` are those of the document's
planners. `{printed}` is the preset of that name, `planner: {{name: nav-scope, preset: {printed}}}`: it sets all keys of
a document's print at once, below those of the scenario itself, for `nav-scope`, `nav-i`, `oracle`, `sfm-mas`, `sfm-i`,
`dh-bug` and `giwt`. `train: key=value` is for `swarmscope giwt train --set` ([giwt.md](giwt.md)). Where there is no
key, the remark says why.

**Measured.** Figures are those of the section that is named; γ and the like are of T1, T2, T3 in this order. Those of
[results.md](results.md) are of the revision that it names. "{unmeasured}": nobody has tried what this alone does.

Paths are below `src/swarmscope/` unless they begin with {beside}.

| document | rows | {names} |
|---|---|{dashes}|
{counts}
"""


class Row(NamedTuple):
    """One item of a document."""

    item: str
    state: str
    where: tuple[str, ...]
    """``path: symbol, symbol``, below the package or one of ``BESIDE``; only the path where it is no Python."""
    preset: tuple[str, ...] = ()
    """What restores the print: ``key=value`` of a scenario, ``train: key=value``, or ``PRINTED``."""
    effect: str = ""
    """What the deviation was measured to do, in figures of ``source``, or ``UNMEASURED``."""
    source: str = ""
    """``page.md#heading`` with these figures."""
    remark: str = ""


class Document(NamedTuple):
    """One of the four."""

    name: str
    letter: str
    """Before the numbers of its rows."""
    planners: tuple[str, ...]
    """Whose parameters its keys may name."""
    about: str
    rows: tuple[Row, ...]


class Place(NamedTuple):
    """Where something stands."""

    shown: str
    """The path as people write it."""
    file: str
    """From the root of the repository on."""
    symbol: str
    line: int
    """0 for a whole file."""


def documents() -> list[Document]:
    """Return what the YAML file holds."""
    content = yaml.safe_load(SOURCE.read_text(encoding="utf-8"))
    return [_document(one) for one in content["documents"]]


def _document(values: dict[str, Any]) -> Document:
    rows = tuple(_row(row) for row in values["rows"])
    return Document(values["name"], values["letter"], tuple(values["planners"]), values["about"], rows)


def _row(values: dict[str, Any]) -> Row:
    lists = {name: tuple(values.get(name) or ()) for name in ("where", "preset")}
    return Row(**{**values, **lists})


def places(row: Row) -> Iterator[Place]:
    """Yield where a row says it stands; raises SystemExit when there is no such file or symbol."""
    for entry in row.where:
        path, _, names = entry.partition(": ")
        file = path if path.split("/")[0] in BESIDE else f"{PACKAGE}/{path}"
        if not (ROOT / file).is_file():
            raise SystemExit(f"{SOURCE.name}: '{row.item}' names {file}: there is no such file")
        if file.endswith(".py") != bool(names):
            raise SystemExit(f"{SOURCE.name}: '{row.item}': {path} needs a symbol if it is Python, else none")
        if not names:
            yield Place(path, file, "", 0)
        for name in names.split(", ") if names else ():
            line = symbols(file).get(name)
            if line is None:
                raise SystemExit(f"{SOURCE.name}: '{row.item}' names {file}: {name}, which is not there")
            yield Place(path, file, name, line)


@cache
def symbols(file: str) -> dict[str, int]:
    """Return the lines of a Python file's functions, classes, constants, and of what its classes hold."""
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    found: dict[str, int] = {}
    for node in tree.body:
        found |= dict.fromkeys(_names(node), node.lineno)
        if isinstance(node, ast.ClassDef):
            found |= {f"{node.name}.{name}": inner.lineno for inner in node.body for name in _names(inner)}
    return found


def _names(node: ast.stmt) -> list[str]:
    """Return what a statement gives a name to."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return [node.name]
    targets: list[ast.expr] = []
    if isinstance(node, ast.Assign):
        targets = node.targets
    elif isinstance(node, ast.AnnAssign):
        targets = [node.target]
    return [part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)]


def page() -> str:
    """Return the page."""
    all_of = documents()
    return "\n".join([_head(all_of), *(_table(one) for one in all_of)])


def _head(all_of: list[Document]) -> str:
    counts = [(one.name, Counter(row.state for row in one.rows)) for one in all_of]
    counts.append(("all", sum((of for _, of in counts), Counter())))
    lines = [f"| {name} | {of.total()} | {' | '.join(str(of[state]) for state in STATES)} |" for name, of in counts]
    return HEAD.format(
        states="\n".join(f"| {state} | {meaning} |" for state, meaning in STATES.items()),
        printed=PRINTED,
        unmeasured=UNMEASURED,
        beside=", ".join(f"`{folder}/`" for folder in BESIDE),
        names=" | ".join(STATES),
        dashes="|".join("---" for _ in STATES),
        counts="\n".join(lines),
    )


def _table(of: Document) -> str:
    lines = [f"## {of.name}\n", f"{of.about}\n"]
    lines += ["| # | item | state | where | restored by | measured effect, remark |", "|---|---|---|---|---|---|"]
    for number, row in enumerate(of.rows, 1):
        where = "<br>".join(_link(place) for place in places(row))
        preset = "<br>".join(f"`{key}`" for key in row.preset)
        cells = [f"{of.letter}{number}", _text(row.item), row.state, where, preset, _text(_words(row))]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def _link(place: Place) -> str:
    target = f"../{place.file}"
    if not place.line:
        return f"[`{place.shown}`]({target})"
    return f"[`{place.shown}:{place.line} {place.symbol}`]({target}#L{place.line})"


def _words(row: Row) -> str:
    """Return effect and remark as sentences."""
    effect = row.effect
    if row.source:
        named = row.source.partition("#")[0]
        effect = f"{effect} ([{named}]({row.source}))"
    sentences = [text if text.endswith((".", ")")) else f"{text}." for text in (_upper(effect), row.remark) if text]
    return " ".join(f"{text}." if text.endswith(")") else text for text in sentences)


def _upper(text: str) -> str:
    return text[:1].upper() + text[1:] if not text.startswith("γ") else text


def _text(text: str) -> str:
    """Return text that a cell of a table can hold."""
    return " ".join(text.replace("|", "\\|").split())


def anchors(file: Path) -> dict[str, str]:
    """Return the sections of a page by their anchors, as GitHub makes them."""
    parts = re.split(r"^#+ (.+)$", file.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {_anchor(title): text for title, text in zip(parts[1::2], parts[2::2], strict=True)}


def _anchor(title: str) -> str:
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)

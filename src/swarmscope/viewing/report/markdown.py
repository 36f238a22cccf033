"""The report as Markdown (GitHub's tables), with its pictures in files beside it."""

from __future__ import annotations

import re
from functools import singledispatch

from swarmscope.viewing.report.blocks import (
    Block,
    Command,
    Document,
    Facts,
    Folded,
    Heading,
    Line,
    Picture,
    Points,
    Row,
    Table,
    Text,
    Value,
    numbers,
)

FIGURES = "figures"
"""Folder of the pictures."""
MARKS = {"good": "✓ ", "bad": "✗ ", "": ""}
Numbers = dict[int, str]


def markdown_text(document: Document) -> str:
    """Return the Markdown text."""
    named = numbers(document)
    parts = [f"# {_plain(document.title)}", _plain(document.about), _block(document.facts, named)]
    parts += ["How to run it again:", _block(document.commands, named)]
    for section in document.sections:
        parts.append(f"## {_plain(section.title)}")
        parts += [_block(block, named) for block in section.blocks]
    return "\n\n".join(parts) + "\n"


@singledispatch
def _block(block: Block, named: Numbers) -> str:
    raise TypeError(f"no way to show a {type(block).__name__}")


@_block.register
def _heading(block: Heading, named: Numbers) -> str:
    return f"### {_plain(block.text)}"


@_block.register
def _text(block: Text, named: Numbers) -> str:
    return _plain(block.text)


@_block.register
def _points(block: Points, named: Numbers) -> str:
    return "\n".join(
        f"- {MARKS[mark]}{f'**{_plain(lead)}** ' if lead else ''}{_plain(text)}" for mark, lead, text in block.entries
    )


@_block.register
def _command(block: Command, named: Numbers) -> str:
    fence = "`" * max(3, 1 + max((len(run) for run in re.findall("`+", block.text)), default=0))
    return f"{fence}\n{block.text}\n{fence}"


@_block.register
def _facts(block: Facts, named: Numbers) -> str:
    return "\n".join(f"- {_plain(what)}: {_plain(value)}" for what, value in block.entries)


@_block.register
def _folded(block: Folded, named: Numbers) -> str:
    inner = "\n\n".join(_block(inner, named) for inner in block.blocks)
    return f"<details><summary>{_plain(block.summary)}</summary>\n\n{inner}\n\n</details>"


@_block.register
def _table(block: Table, named: Numbers) -> str:
    align = "---" if block.words else "---:"
    lines = [
        "| " + " | ".join(_plain(name) or " " for name in block.header) + " |",
        "| --- |" + f" {align} |" * (len(block.header) - 1),
        *(_row(row, block.words) for row in block.rows),
    ]
    caption = f"**{named.get(id(block), 'Table')}.** {_plain(block.caption)}"
    return "\n\n".join([caption, "\n".join(lines), *([_plain(block.note)] if block.note else [])])


def _row(row: Row, words: bool) -> str:
    shown = (_value(value, row.strong and not (words and k)) for k, value in enumerate(row.values))
    return "| " + " | ".join(shown) + " |"


def _value(value: Value, strong: bool) -> str:
    parts = (f"{' ' if line.kind == 'beside' else '<br>'}{_line(line, strong)}" for line in value)
    return "".join(parts).removeprefix("<br>") or " "


def _line(line: Line, strong: bool) -> str:
    text = MARKS[line.mark] + _plain(line.text)
    return f"**{text}**" if strong and line.kind == "main" and line.text else text


@_block.register
def _picture(block: Picture, named: Numbers) -> str:
    text = f"![{_plain(block.alt)}]({FIGURES}/{block.name}.png)\n\n**{named[id(block)]}.** {_plain(block.caption)}"
    return text if block.beside is None else f"{text}\n\n{_table(block.beside, named)}"


def _plain(text: str) -> str:
    """Return ``text`` on one line with everything that Markdown or HTML would read as a sign escaped."""
    text = " ".join(text.split()) if "\n" in text else text
    text = text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return re.sub(r"([\\`*_\[\]|#~])", r"\\\1", text)

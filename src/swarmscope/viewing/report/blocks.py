"""What a report is made of: sections of blocks of plain text, which the page and the Markdown file render alike."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

Mark = Literal["", "good", "bad"]


class Line(NamedTuple):
    """One line of a table's cell."""

    text: str
    kind: Literal["main", "beside", "plain", "sub", "code"] = "main"
    """``beside`` stands on the line of the one before."""
    mark: Mark = ""


Value = list[Line]
"""A table's cell."""


class Row(NamedTuple):
    """One row of a table; ``strong`` rows stand out."""

    values: list[Value]
    strong: bool = False
    swatch: str = ""
    """Colour of the planner that the row is about."""


@dataclass(frozen=True)
class Heading:
    """A heading within a chapter."""

    text: str


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str
    kind: Literal["body", "note"] = "body"


@dataclass(frozen=True)
class Points:
    """A list; each entry is (mark, words in front, sentence)."""

    entries: list[tuple[Mark, str, str]]


@dataclass(frozen=True)
class Command:
    """Lines for a terminal, or any text to be shown as typed."""

    text: str


@dataclass(frozen=True)
class Facts:
    """Short facts: (what, value)."""

    entries: list[tuple[str, str]]


@dataclass(frozen=True)
class Table:
    """A table; the first column names the rows."""

    caption: str
    header: list[str]
    rows: list[Row]
    note: str = ""
    numbered: bool = True
    words: bool = False
    """Columns hold words (left aligned), not numbers."""


@dataclass(frozen=True)
class Picture:
    """A drawing in two forms: SVG for the page, PNG for the Markdown file."""

    name: str
    """Stem of its file."""
    caption: str
    alt: str
    svg: str
    png: bytes
    width_px: int
    """Width that it is drawn for."""
    beside: Table | None = None


@dataclass(frozen=True)
class Folded:
    """Blocks that are shown on demand."""

    summary: str
    blocks: Sequence[Block]


Block = Heading | Text | Points | Command | Facts | Table | Picture | Folded


@dataclass(frozen=True)
class Section:
    """A chapter with an identifier for links."""

    title: str
    ident: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class Document:
    """A whole report."""

    title: str
    subtitle: str
    about: str
    facts: Facts
    commands: Command
    sections: list[Section] = field(default_factory=list)


def walk(blocks: Sequence[Block]) -> Iterator[Block]:
    """Yield every block, folded ones and tables beside pictures too, in the order of reading."""
    for block in blocks:
        yield block
        if isinstance(block, Folded):
            yield from walk(block.blocks)
        elif isinstance(block, Picture) and block.beside is not None:
            yield block.beside


def numbers(document: Document) -> dict[int, str]:
    """Return 'Table 3' or 'Figure 2' by the ``id`` of each numbered table and picture."""
    found: dict[int, str] = {}
    tables = pictures = 0
    for section in document.sections:
        for block in walk(section.blocks):
            if isinstance(block, Table) and block.numbered:
                tables += 1
                found[id(block)] = f"Table {tables}"
            elif isinstance(block, Picture):
                pictures += 1
                found[id(block)] = f"Figure {pictures}"
    return found


def pictures_of(document: Document) -> list[Picture]:
    """Return every picture of the document."""
    blocks = (block for section in document.sections for block in walk(section.blocks))
    return [block for block in blocks if isinstance(block, Picture)]


def cell(text: str, beside: str = "", *subs: str) -> Value:
    """Return a cell with one main line, something small on the same line, and small lines below it."""
    return [Line(text), *([Line(beside, "beside")] if beside else []), *(Line(sub, "sub") for sub in subs if sub)]

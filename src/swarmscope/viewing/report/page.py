"""The report as one HTML file that needs nothing else."""

from __future__ import annotations

import re
from functools import singledispatch
from html import escape
from importlib.resources import files

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
    Section,
    Table,
    Text,
    Value,
    numbers,
)
from swarmscope.viewing.report.drawing import DARK, SYMBOL, data_uri

Numbers = dict[int, str]
SHORT = 24
NAME = r"(?<![\w&;./-])\w{1,8}(?:-\w{1,8}){1,2}(?![\w./-])"
"""Names with hyphens, which are not broken there."""
ZOOM = 1.24
"""Width of a figure on a wide page over the width that it is drawn for."""
WIDE_PX = 560
"""A wider figure is scrolled on a narrow page, not shrunk until its type cannot be read."""


def page_text(document: Document) -> str:
    """Return the HTML text."""
    named = numbers(document)
    template = (files("swarmscope.viewing.report") / "page.html").read_text(encoding="utf-8")
    contents = "".join(f'<a href="#{escape(s.ident)}">{escape(s.title)}</a>' for s in document.sections)
    parts = {
        "TITLE": escape(document.title),
        "NAME": escape(document.subtitle),
        "ABOUT": _words(document.about),
        "FACTS": _block(document.facts, named),
        "COMMAND": _block(document.commands, named),
        "CONTENTS": contents,
        "SECTIONS": "\n".join(_section(section, named) for section in document.sections),
    }
    return re.sub(r"\{\{([A-Z]+)\}\}", lambda found: parts[found[1]], template)


def _section(section: Section, named: Numbers) -> str:
    inner = "\n".join(_block(block, named) for block in section.blocks)
    return f'<section id="{escape(section.ident)}"><h2>{escape(section.title)}</h2>\n{inner}\n</section>'


@singledispatch
def _block(block: Block, named: Numbers) -> str:
    raise TypeError(f"no way to show a {type(block).__name__}")


@_block.register
def _heading(block: Heading, named: Numbers) -> str:
    return f"<h3>{_words(block.text)}</h3>"


@_block.register
def _text(block: Text, named: Numbers) -> str:
    return f'<p class="{block.kind}">{_words(block.text)}</p>'


@_block.register
def _points(block: Points, named: Numbers) -> str:
    entries = (
        f'<li class="{mark or "open"}">{f"<b>{escape(lead)}</b> " if lead else ""}{_words(text)}</li>'
        for mark, lead, text in block.entries
    )
    return f'<ul class="points">{"".join(entries)}</ul>'


@_block.register
def _command(block: Command, named: Numbers) -> str:
    return f'<pre tabindex="0"><code>{escape(block.text)}</code></pre>'


@_block.register
def _facts(block: Facts, named: Numbers) -> str:
    entries = (f"<div><dt>{escape(what)}</dt><dd>{escape(value)}</dd></div>" for what, value in block.entries)
    return f'<dl class="facts">{"".join(entries)}</dl>'


@_block.register
def _folded(block: Folded, named: Numbers) -> str:
    inner = "\n".join(_block(inner, named) for inner in block.blocks)
    return f"<details><summary>{_words(block.summary)}</summary>{inner}</details>"


@_block.register
def _table(block: Table, named: Numbers) -> str:
    head = "".join(f'<th scope="col">{_words(name)}</th>' for name in block.header)
    rows = "".join(_row(row) for row in block.rows)
    note = f'<p class="source">{_words(block.note)}</p>' if block.note else ""
    kind = "words" if block.words else "figures"
    caption = f'<div class="caption"><b>{named.get(id(block), "Table")}.</b> {_words(block.caption)}</div>'
    inner = f'<table class="{kind}"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'
    label = escape(block.caption)
    scroll = f'<div class="scroll" tabindex="0" role="region" aria-label="{label}">{inner}</div>'
    return f'<div class="table">{caption}{scroll}{note}</div>'


def _row(row: Row) -> str:
    first, *others = row.values
    swatch = _swatch(row.swatch) if row.swatch else ""
    values = "".join(f"<td>{_value(value)}</td>" for value in others)
    strong = ' class="strong"' if row.strong else ""
    return f'<tr{strong}><th scope="row">{swatch}{_value(first)}</th>{values}</tr>'


def _swatch(colour: str) -> str:
    dark = DARK.get(colour, colour)
    style = f"background:{colour};background:light-dark({colour},{dark})"
    return f'<span class="swatch" style="{escape(style)}"></span>'


def _value(value: Value) -> str:
    return "".join(_line(line) for line in value)


def _line(line: Line) -> str:
    text = escape(line.text) if line.kind == "code" else _words(line.text)
    short = " short" if line.kind == "code" and len(line.text) < SHORT else ""
    before = " " if line.kind == "beside" else ""
    return f'{before}<span class="{f"{line.kind} {line.mark}{short}".strip()}">{text}</span>'


@_block.register
def _picture(block: Picture, named: Numbers) -> str:
    image = f'<img src="{data_uri(block.svg)}" alt="{escape(block.alt)}" width="{round(ZOOM * block.width_px)}">'
    caption = f"<figcaption><b>{named[id(block)]}.</b> {_words(block.caption)}</figcaption>"
    scroll = f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(block.alt)}">{image}</div>'
    wide = ' class="wide"' if block.width_px > WIDE_PX else ""
    figure = f'<figure id="{escape(block.name)}"{wide}>{scroll}{caption}</figure>'
    if block.beside is None:
        return figure
    return f'<div class="beside">{figure}{_table(block.beside, named)}</div>'


def _words(text: str) -> str:
    """Return escaped text with symbols such as w_i set with an index."""
    text = re.sub(SYMBOL, r"<i>\1</i><sub>\2</sub>", escape(text)).replace(" %", "&nbsp;%")
    return re.sub(NAME, r'<span class="whole">\g<0></span>', text)

"""The report of an experiment: what was measured, beside what was published, as a page and as Markdown."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from swarmscope.experiments.experiment import Experiment
from swarmscope.experiments.results import Run
from swarmscope.experiments.weight import WeightResult
from swarmscope.viewing.report.blocks import pictures_of
from swarmscope.viewing.report.document import make_document
from swarmscope.viewing.report.drawing import style
from swarmscope.viewing.report.markdown import FIGURES, markdown_text
from swarmscope.viewing.report.material import Material
from swarmscope.viewing.report.page import page_text
from swarmscope.viewing.report.publish import put_in_place

__all__ = ["write_report"]


def write_report(
    experiment: Experiment,
    runs: list[Run],
    out: Path,
    weight: WeightResult | None = None,
    progress: Callable[[str], None] | None = None,
    run_files: bool = True,
) -> Path:
    """Write ``report.html`` (holds everything), ``report.md`` and ``figures/`` into ``out``; return the page's path.

    Runs that pictures need are played again; unless ``run_files``, none that a user's file has a part
    in. ``progress`` is told what is being made.
    """
    with style():
        document = make_document(Material(experiment, runs, weight), progress or (lambda _: None), run_files)
    contents = {f"{FIGURES}/{picture.name}.png": picture.png for picture in pictures_of(document)}
    contents["report.md"] = markdown_text(document).encode("utf-8")
    contents["report.html"] = page_text(document).encode("utf-8")
    put_in_place(out, contents)
    return out / "report.html"

"""Names of users in figures: no mathematics, no warnings, and nobody's settings changed."""

from __future__ import annotations

import io
import warnings

import matplotlib as mpl
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from swarmscope.lettering import drawing


def drawn(name: str) -> bytes:
    with drawing():
        figure = Figure(figsize=(3, 1))
        FigureCanvasAgg(figure)
        figure.suptitle(name)
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


@pytest.mark.parametrize("name", ["a\0b", "字", "$\\frac{$", "$x$"])
def test_any_name_can_be_drawn_and_warns_of_nothing(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert drawn(name) == drawn(name)


def test_a_dollar_sign_is_a_dollar_sign():
    assert drawn("$x$") != drawn("x")


def test_settings_of_matplotlib_stay():
    before = dict(mpl.rcParams)
    with drawing():
        assert not mpl.rcParams["text.parse_math"]
    assert dict(mpl.rcParams) == before

"""Figures: the same whatever the user's settings of matplotlib, with any letters in names and titles."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def drawing() -> Iterator[None]:
    """Draw with matplotlib's defaults. A dollar sign is a dollar sign; letters that the font lacks become boxes."""
    import matplotlib as mpl

    with mpl.rc_context(), warnings.catch_warnings():
        mpl.rcdefaults()
        mpl.rcParams["text.parse_math"] = False
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        yield

"""What happened in a run, by name: the arrays of ``trajectory.npz``, which nobody can change by mistake."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from swarmscope.errors import nearest_hint

Array = npt.NDArray[Any]


class Trace(Mapping[str, Array]):
    """The arrays of a run, as ``trace.x_m`` or ``trace["x_m"]``; docs/architecture.md lists them."""

    def __init__(self, arrays: Mapping[str, Array]) -> None:
        self._arrays = {name: _locked(array) for name, array in arrays.items()}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the arrays."""
        return tuple(self._arrays)

    @property
    def states(self) -> Array:
        """(T, N) state of each robot in words."""
        return self["state_names"][self["state"]]

    @property
    def reasons(self) -> Array:
        """(T, N) why each robot did what it did, in words."""
        return self["reason_names"][self["reason"]]

    def __getitem__(self, name: str) -> Array:
        """Return an array; a KeyError names the nearest."""
        try:
            return self._arrays[name]
        except KeyError:
            raise KeyError(f"'{name}'{nearest_hint(name, self._arrays)}") from None

    def __getattr__(self, name: str) -> Array:
        """Return an array; an AttributeError names the nearest."""
        arrays = self.__dict__.get("_arrays", {})
        if name not in arrays:
            raise AttributeError(f"a trace has no '{name}'{nearest_hint(name, arrays)}")
        found: Array = arrays[name]
        return found

    def __iter__(self) -> Iterator[str]:
        """Go through the names."""
        return iter(self._arrays)

    def __len__(self) -> int:
        """Return the number of arrays."""
        return len(self._arrays)

    def __dir__(self) -> list[str]:
        """Name the arrays, too."""
        return [*super().__dir__(), *self._arrays]

    def __repr__(self) -> str:
        """Say how much there is."""
        ticks, robots = self["x_m"].shape
        return f"<Trace of {robots} robots over {ticks} ticks: {', '.join(self._arrays)}>"


def _locked(array: Array) -> Array:
    """Return a view of the array that cannot be written to."""
    view: Array = np.asarray(array).view()
    view.flags.writeable = False
    return view

"""Named tuples of arrays that stay where they are: kernels are given their address.

Numba takes a tuple apart value by value whenever Python hands one over: 20 to 30 us for a `Swarm` or a `Sim` of three
hundred numbers, as long as fifteen robots' sensing takes. A `Held` is taken apart once, when it is made; a kernel
reads ``held.what`` from its memory. Between kernels tuples are handed over as they are (see ``_jit.jit_inline``).
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any, Generic, TypeVar, cast

import numpy as np
from numba import config, extending, typeof, types
from numba.core.typing.templates import AttributeTemplate

from swarmscope._jit import jit

What = TypeVar("What")
numba: Any = extending  # which has no types of its own
kind_of: Any = typeof


class Held(Generic[What]):
    """Holds ``what`` for kernels, and keeps it alive. Its numbers are those of now; its arrays stay the same ones."""

    def __init__(self, what: What) -> None:
        self.what = what
        if cast("Any", config).DISABLE_JIT:
            return
        self._numba_type_ = _kind_of(what)
        self._memory = np.zeros(_size_of(what), np.uint8)
        self.address = self._memory.ctypes.data
        _put(self, what)


_kinds: dict[Hashable, HeldType] = {}


def _kind_of(what: Any) -> HeldType:
    """Return the type of what holds ``what``; Numba takes a millisecond and more to tell that of a large tuple."""
    key = _key_of(what)
    if key not in _kinds:
        _kinds[key] = HeldType(kind_of(what))
    return _kinds[key]


def _key_of(part: Any) -> Hashable:
    """Return what the type of a tuple or of a part of it follows from."""
    if isinstance(part, tuple):
        return type(part), *map(_key_of, part)
    if isinstance(part, np.ndarray):
        flags = part.flags
        return part.dtype, part.ndim, flags.c_contiguous, flags.f_contiguous, flags.writeable, flags.aligned
    kind: type = type(part)
    return kind


class HeldType(types.Type):
    """What Numba calls a `Held`."""

    def __init__(self, what: Any) -> None:
        self.what = what
        super().__init__(name=f"Held({what})")


numba.register_model(HeldType)(numba.models.OpaqueModel)


@numba.unbox(HeldType)  # type: ignore[untyped-decorator]
def _unbox(_: Any, held: Any, c: Any) -> Any:
    address = c.pyapi.object_getattr_string(held, "address")
    pointer = c.pyapi.long_as_voidptr(address)
    c.pyapi.decref(address)
    return numba.NativeValue(pointer)


@numba.infer_getattr
class _Attributes(AttributeTemplate):
    key = HeldType

    def resolve_what(self, held: Any) -> Any:
        return held.what


@numba.lower_getattr_generic(HeldType)  # type: ignore[untyped-decorator]
def _read(context: Any, builder: Any, kind: Any, held: Any, _: str) -> Any:
    return builder.load(_place(context, builder, kind, held))


def _place(context: Any, builder: Any, kind: Any, held: Any) -> Any:
    """Return the pointer to what is held."""
    return builder.bitcast(held, context.get_value_type(kind.what).as_pointer())


@numba.intrinsic  # type: ignore[untyped-decorator]
def _store(_: Any, held: Any, what: Any) -> Any:
    """Write a tuple to where it is held."""

    def write(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        builder.store(values[1], _place(context, builder, signature.args[0], values[0]))
        return context.get_dummy_value()

    return types.void(held, what), write


@numba.intrinsic  # type: ignore[untyped-decorator]
def _bytes_of(_: Any, what: Any) -> Any:
    """Return the bytes of a tuple as kernels have it."""

    def count(context: Any, _: Any, signature: Any, __: Any) -> Any:
        size = context.get_abi_sizeof(context.get_value_type(signature.args[0]))
        return context.get_constant(types.intp, size)

    return types.intp(what), count


@jit
def _size_of(what: Any) -> int:
    """Return how many bytes hold a tuple."""
    return int(_bytes_of(what))


@jit
def _put(held: Any, what: Any) -> None:
    """Write ``what`` where it is held."""
    _store(held, what)

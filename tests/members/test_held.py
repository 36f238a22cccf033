"""What kernels are given by its address."""

import gc
import os

import numpy as np
import pytest

from swarmscope._jit import jit
from swarmscope.held import Held


@jit
def total(held):
    (rows, scale), count, flags = held.what
    found = 0.0
    for i in range(count):
        found += scale * rows[i]
        flags[i] = 1
    return found


def outer(count, scale=2.0, rows=None):
    """Plain tuples: the cache names the types that it knows, and a test's own would be unknown elsewhere."""
    return (np.arange(count, dtype=float) if rows is None else rows, scale), count, np.zeros(count, np.uint8)


def test_a_kernel_reads_and_writes_what_is_held():
    what = outer(4)
    held = Held(what)
    assert held.what is what
    assert total(held) == 2.0 * (0 + 1 + 2 + 3)
    assert what[2].tolist() == [1, 1, 1, 1]
    what[0][0][3] = 10.0
    assert total(held) == 2.0 * (0 + 1 + 2 + 10)


def test_it_keeps_alive_what_it_holds():
    held = [Held(outer(1000, scale)) for scale in (1.0, 3.0)]
    gc.collect()
    rubbish = [np.full(1000, 7.0) for _ in range(50)]
    assert [total(one) for one in held] == [499500.0, 3 * 499500.0]
    assert len(rubbish) == 50


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT", "0") == "1", reason="needs compiled kernels")
def test_what_looks_alike_but_is_of_another_type_is_told_apart():
    wide, narrow = outer(3), outer(3, rows=np.arange(3, dtype=np.float32))
    strided = outer(3, rows=np.arange(6, dtype=float)[::2])
    assert [total(Held(one)) for one in (wide, narrow, strided)] == [6.0, 6.0, 12.0]
    assert len({Held(one)._numba_type_ for one in (wide, narrow, strided, outer(7))}) == 3

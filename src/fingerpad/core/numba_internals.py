"""What the package uses of Numba beyond its documented interface: the only file that does.

Numba may change these parts in any release. `TRIED` names the versions with which the tests of this file have
passed; a test fails with any other version, which must be checked before it is allowed.

Small arrays live on the stack of a compiled function, for kernels that run once per element. `np.empty`
allocates on the heap, which costs as much as dozens of multiplications, and the compiler must assume that the
memory overlaps every other array: it reads numbers again after each write and does not vectorise loops over
eight nodes. The size of an array on the stack is known, and nothing overlaps it.
"""

from __future__ import annotations

from collections.abc import Callable
from math import prod
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.core.event import Listener, register
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

TRIED = ("0.61", "0.65", "0.68")  # Versions of Numba with which this file was tried.
ALIGNMENT = 64  # Bytes of the widest vector registers, whose loads are fastest from such addresses.


def is_compiled(kernel: Any) -> bool:
    """Whether a cached Numba kernel need not be compiled."""
    if getattr(kernel, "signatures", ()):
        return True
    try:
        # Numba's own reading of its index, which is empty if another version or another source wrote it.
        return bool(kernel._cache._cache_file._load_index())
    except AttributeError:
        return True


class _Compilations(Listener):
    """Tells of functions of this package that Numba begins to compile; what its cache has is not compiled."""

    def __init__(self, tell: Callable[[], None]):
        self._tell = tell

    def on_start(self, event: Any) -> None:
        home = event.data["dispatcher"].py_func.__module__ or ""
        if home.partition(".")[0] == __package__.partition(".")[0]:
            self._tell()

    def on_end(self, event: Any) -> None:
        pass


def tell_compilations(tell: Callable[[], None]) -> None:
    """Call a function before each compilation of a function of this package, whoever calls it."""
    register("numba:compile", _Compilations(tell))


@intrinsic(prefer_literal=True)
def small_array(typing_context: Any, shape: Any) -> Any:
    """Uninitialised array of float64 for use in compiled functions.

    Its memory is freed when the function that made it returns: pass it to other functions, but never return
    or store it. An array made in a loop has the same memory in each round.
    """
    return _on_the_stack(shape, types.float64, ir.DoubleType())


@intrinsic(prefer_literal=True)
def small_single_array(typing_context: Any, shape: Any) -> Any:
    """Uninitialised array of float32 for use in compiled functions, else like `small_array`."""
    return _on_the_stack(shape, types.float32, ir.FloatType())


def _on_the_stack(shape: Any, number_type: Any, number: Any) -> Any:
    """Signature and code of a function that makes an array of such numbers."""
    members = getattr(shape, "types", ())
    if not members or not all(isinstance(size, types.Literal) for size in members):
        raise TypingError(f"A small array needs a tuple of constant sizes, such as (8, 3): got {shape}.")
    sizes = [size.literal_value for size in members]
    array_type = types.Array(number_type, len(sizes), "C")
    number_bytes = number_type.bitwidth // 8

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        def constants(values: list[int]) -> Any:
            return cgutils.pack_array(builder, [context.get_constant(types.intp, value) for value in values])

        with builder.goto_entry_block():  # once per call, also for an array that is made in a loop
            memory = builder.alloca(ir.ArrayType(number, prod(sizes)))
            memory.align = ALIGNMENT
        array = make_array(array_type)(context, builder)
        populate_array(
            array,
            data=builder.bitcast(memory, number.as_pointer()),
            shape=constants(sizes),
            strides=constants([number_bytes * prod(sizes[axis + 1 :]) for axis in range(len(sizes))]),
            itemsize=context.get_constant(types.intp, number_bytes),
            meminfo=None,  # no reference counting
        )
        return array._getvalue()

    return array_type(shape), build

"""Small arrays on the stack of a compiled function, for kernels that run once per element.

`np.empty` asks the heap for memory, which costs as much as dozens of multiplications, and the compiler must
assume that what it gets overlaps every other array: it reads numbers again after each write, and leaves loops
over eight nodes one number at a time. Of an array on the stack it knows the size, and that nothing overlaps.
"""

from __future__ import annotations

from math import prod
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

ALIGNMENT = 64
"""Bytes of the widest vector registers, whose loads are fastest from such addresses."""


@intrinsic(prefer_literal=True)
def small_array(typing_context: Any, shape: Any) -> Any:
    """Uninitialised array of float64 for use in compiled functions.

    Its memory goes when the function that made it returns: pass it on to others, but never return or keep
    it. An array made in a loop is one and the same each time.

    Parameters
    ----------
    shape : tuple of int
        Sizes, literal numbers or global constants: they must be known to the compiler.

    Returns
    -------
    array
        Float64 in C order, with whatever numbers were in its memory.

    Raises
    ------
    numba.errors.TypingError
        If the compiler does not know the sizes.

    Examples
    --------
    >>> from numba import njit
    >>> @njit
    ... def squares_of_three():
    ...     squares = small_array((3,))
    ...     for k in range(3):
    ...         squares[k] = k * k
    ...     return squares.sum()
    >>> squares_of_three()
    5.0
    """
    return _on_the_stack(shape, types.float64, ir.DoubleType())


@intrinsic(prefer_literal=True)
def small_single_array(typing_context: Any, shape: Any) -> Any:
    """Uninitialised array of float32 for use in compiled functions, else like `small_array`.

    Examples
    --------
    >>> from numba import njit
    >>> @njit
    ... def third():
    ...     numbers = small_single_array((1,))
    ...     numbers[0] = 1.0 / 3.0
    ...     return numbers[0]
    >>> third()
    0.3333333432674408
    """
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
            meminfo=None,  # nobody counts references to it
        )
        return array._getvalue()

    return array_type(shape), build

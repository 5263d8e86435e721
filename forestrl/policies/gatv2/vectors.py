"""Short vectors of fixed width for numba: one value that the compiler keeps in wide registers.

Numba vectorises loops; sums over short groups of channels defeat it. A :class:`Vector` states the
width instead. Widths come from a *shape*: nested tuples of ``None``, built by :func:`static`,
whose lengths are constants when the code is compiled.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.extending import intrinsic, models, overload, register_model

_INT = ir.IntType(32)
_CONTRACT = ("contract",)  # multiply-add in one step; keeps infinities and NaN
_EXP = (  # 2^n * polynomial, |error| < 1e-7 relative, for float32
    *(1 / 5040, 1 / 720, 1 / 120, 1 / 24, 1 / 6, 0.5, 1.0, 1.0),
)


class Vector(types.Type):
    """The numba type of ``width`` numbers of one float type."""

    def __init__(self, dtype: types.Type, width: int) -> None:
        self.dtype, self.width = dtype, width
        super().__init__(name=f"Vector({dtype}, {width})")


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):
    """Stores a :class:`Vector` as an LLVM vector."""

    def __init__(self, dmm: Any, vector: Vector) -> None:
        element = dmm.lookup(vector.dtype).get_value_type()
        super().__init__(dmm, vector, ir.VectorType(element, vector.width))


def static(*sizes: int) -> tuple[tuple[None, ...], ...]:
    """Returns a shape whose sizes are compile-time constants inside numba functions."""
    return tuple((None,) * size for size in sizes)


def _shuffle(builder: ir.IRBuilder, value: ir.Value, lanes: list[int]) -> ir.Value:
    mask = ir.Constant(ir.VectorType(_INT, len(lanes)), [ir.Constant(_INT, i) for i in lanes])
    return builder.shuffle_vector(value, ir.Constant(value.type, ir.Undefined), mask)


def _widen(context: Any, builder: ir.IRBuilder, value: ir.Value, given: Any, to: Vector) -> Any:
    """Returns a vector as it is, and a scalar in every lane."""
    if isinstance(given, Vector):
        return value
    value = context.cast(builder, value, given, to.dtype)
    one = ir.Constant(ir.VectorType(value.type, 1), ir.Undefined)
    one = builder.insert_element(one, value, ir.Constant(_INT, 0))
    return _shuffle(builder, one, [0] * to.width)


def _constant(llvm: ir.VectorType, value: float) -> ir.Constant:
    return ir.Constant(llvm, [ir.Constant(llvm.element, value)] * llvm.count)


def _lift(symbol: Callable, instruction: str) -> None:
    """Gives vectors an arithmetic operator, also with scalars."""

    @intrinsic
    def apply(typing_context, a, b) -> tuple:
        vector = a if isinstance(a, Vector) else b

        def build(context, builder, signature, args):
            pair = zip(args, signature.args, strict=True)
            left, right = (_widen(context, builder, v, given, vector) for v, given in pair)
            return getattr(builder, instruction)(left, right, flags=_CONTRACT)

        return vector(a, b), build

    def lifted(a: Any, b: Any) -> Any:
        return apply(a, b)

    @overload(symbol)
    def choose(a: Any, b: Any) -> Any:
        return lifted if isinstance(a, Vector) or isinstance(b, Vector) else None


for _symbol, _instruction in (
    (operator.add, "fadd"),
    (operator.iadd, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _lift(_symbol, _instruction)


def _address(context: Any, builder: Any, signature: Any, args: Any, vector: Vector) -> ir.Value:
    """The address of row ``args[1]`` of the two-dimensional array ``args[0]``."""
    array = context.make_array(signature.args[0])(context, builder, args[0])
    row = context.cast(builder, args[1], signature.args[1], types.intp)
    _, width = cgutils.unpack_tuple(builder, array.shape)
    start = builder.gep(array.data, [builder.mul(row, width)])
    return builder.bitcast(start, context.get_value_type(vector).as_pointer())


def _require_rows(array: types.Array) -> None:
    if array.ndim != 2 or array.layout != "C":
        msg = f"rows are taken from C-contiguous matrices, not from {array}"
        raise TypingError(msg)


@intrinsic
def load(typing_context, array, row, lanes) -> tuple:
    """``load(array, row, lanes)``: the row of a C-contiguous matrix with ``len(lanes)`` columns."""
    _require_rows(array)
    vector = Vector(array.dtype, lanes.count)

    def build(context, builder, signature, args):
        address = _address(context, builder, signature, args, vector)
        return builder.load(
            address, align=array.dtype.bitwidth // 8, typ=context.get_value_type(vector)
        )

    return vector(array, row, lanes), build


@intrinsic
def store(typing_context, array, row, vector) -> tuple:
    """``store(array, row, vector)``: writes a row of a C-contiguous matrix."""
    _require_rows(array)

    def build(context, builder, signature, args):
        address = _address(context, builder, signature, args, vector)
        builder.store(args[2], address, align=array.dtype.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(array, row, vector), build


@intrinsic
def where_positive(typing_context, condition, yes, no) -> tuple:
    """``yes`` in the lanes where ``condition > 0`` and ``no`` in the others."""

    def build(context, builder, signature, args):
        a, b = (
            _widen(context, builder, v, given, condition)
            for v, given in zip(args[1:], signature.args[1:], strict=True)
        )
        zero = _constant(args[0].type, 0.0)
        return builder.select(builder.fcmp_ordered(">", args[0], zero), a, b)

    return condition(condition, yes, no), build


@intrinsic
def group_sums(typing_context, vector, lanes) -> tuple:
    """Sums of ``len(lanes)`` equal groups of neighbouring lanes, by halving the groups."""
    groups = lanes.count

    def build(context, builder, signature, args):
        value, size, rest = args[0], vector.width // groups, None
        while size > 1:
            half = size // 2
            lower, upper, last = (
                [g * size + i for g in range(groups) for i in part]
                for part in (range(half), range(half, 2 * half), range(size - 1, size))
            )
            if size % 2:
                odd = _shuffle(builder, value, last)
                rest = odd if rest is None else builder.fadd(rest, odd)
            value = builder.fadd(_shuffle(builder, value, lower), _shuffle(builder, value, upper))
            size = half
        return value if rest is None else builder.fadd(value, rest)

    return Vector(vector.dtype, groups)(vector, lanes), build


@intrinsic
def spread(typing_context, vector, lanes) -> tuple:
    """Repeats every lane ``len(lanes)`` times, neighbouring: the inverse shape of group_sums."""

    def build(context, builder, signature, args):
        return _shuffle(
            builder, args[0], [i for i in range(vector.width) for _ in range(lanes.count)]
        )

    return Vector(vector.dtype, vector.width * lanes.count)(vector, lanes), build


@intrinsic
def exp(typing_context, vector) -> tuple:
    """The exponential: 1e-7 relative in float32 within [-87, 88], clamped there; libm otherwise."""

    def build(context, builder, signature, args):
        x = args[0]
        llvm, number = x.type, lambda value: _constant(x.type, value)
        if vector.dtype != types.float32:
            function = ir.FunctionType(llvm, [llvm])
            name = f"llvm.exp.v{vector.width}f64"
            return builder.call(cgutils.get_or_insert_function(builder.module, function, name), [x])
        for symbol, bound in (("<", -87.0), (">", 88.0)):
            outside = builder.fcmp_ordered(symbol, x, number(bound))
            x = builder.select(outside, number(bound), x)
        # Adding 1.5 * 2^23 rounds to an integer, which is then in the lowest bits.
        shifted = builder.fadd(
            builder.fmul(x, number(1 / np.log(2)), flags=_CONTRACT),
            number(12582912.0),
            flags=_CONTRACT,
        )
        whole = builder.fsub(shifted, number(12582912.0))
        rest = builder.fsub(
            x, builder.fmul(whole, number(np.log(2)), flags=_CONTRACT), flags=_CONTRACT
        )
        value = number(_EXP[0])
        for coefficient in _EXP[1:]:
            value = builder.fadd(
                builder.fmul(value, rest, flags=_CONTRACT), number(coefficient), flags=_CONTRACT
            )
        bits = ir.VectorType(_INT, vector.width)
        power = builder.shl(builder.bitcast(shifted, bits), _constant(bits, 23))
        return builder.bitcast(builder.add(builder.bitcast(value, bits), power), llvm)

    return vector(vector), build

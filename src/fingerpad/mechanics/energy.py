"""Strain energies written as formulas, with exact first and second derivatives.

A formula in the principal stretches is translated once into a short list of operations. The compiled kernel
runs the list on numbers that carry their gradient and Hessian along (forward differentiation), in terms of

    x = (ln lambdabar_1, ln lambdabar_2, ln lambdabar_3, ln J),     lambdabar_a = J^(-1/3) lambda_a,

in which stress and stiffness of an isotropic law take their simplest form (Ogden 1984, ch. 6; see `element`).
Nothing is differentiated by hand, so a law is as long as its formula.

A formula may use

    lambda1, lambda2, lambda3            principal stretches
    lambdabar1, lambdabar2, lambdabar3   the same without the change of volume
    I1, I2                               invariants of the isochoric deformation, 3 at rest
    J                                    volume over reference volume

numbers, its own coefficients, + - * / **, and log, exp, sqrt.
"""

from __future__ import annotations

import ast
import operator
import warnings
from collections.abc import Callable, Mapping

import numpy as np
from numba import njit

from fingerpad.core.errors import InputError, shown
from fingerpad.core.values import FloatArray, finite

VARIABLES = (
    "lambdabar1", "lambdabar2", "lambdabar3", "lambda1", "lambda2", "lambda3", "J", "I1", "I2",
)  # fmt: skip
FUNCTIONS = ("log", "exp", "sqrt")
MOST_OPERATIONS = 200
LONGEST_FORMULA = 4000

VARIABLE, ADD, SUBTRACT, MULTIPLY, DIVIDE, SCALE, SHIFT, POWER, LOG, EXP = range(10)
OPERATION_SIZE = 4  # Numbers per operation: its code, the results it takes (left, right) and a constant.
CARRIED = 15  # A value, its gradient (4) and the upper triangle of its Hessian (10).

ROW = np.array([0, 0, 0, 0, 1, 1, 1, 2, 2, 3])
COLUMN = np.array([0, 1, 2, 3, 1, 2, 3, 2, 3, 3])
SECOND = np.array([[5, 6, 7, 8], [6, 9, 10, 11], [7, 10, 12, 13], [8, 11, 13, 14]])
"""Where a second derivative is carried."""

_BINARY: dict[type[ast.operator], tuple[int, Callable[[float, float], float]]] = {
    ast.Add: (ADD, operator.add),
    ast.Sub: (SUBTRACT, operator.sub),
    ast.Mult: (MULTIPLY, operator.mul),
    ast.Div: (DIVIDE, operator.truediv),
}


def translate(formula: str, coefficients: Mapping[str, float]) -> FloatArray:
    """List of operations of a formula."""
    return _Translator(formula, coefficients).program()


class _Translator:
    """Walks over a parsed formula; a part is either a number or the index of an operation."""

    def __init__(self, formula: str, coefficients: Mapping[str, float]):
        if not isinstance(formula, str) or len(formula) > LONGEST_FORMULA:
            raise InputError(
                f"An energy must be a formula, a text of at most {LONGEST_FORMULA:,} characters: got "
                f"{shown(formula)}."
            )
        self.formula, self.said = formula, shown(formula)
        self.coefficients = {name: finite(name, value) for name, value in coefficients.items()}
        for name in self.coefficients:
            if name in VARIABLES or name in FUNCTIONS:
                raise InputError(
                    f"{name!r} is a variable of every energy: give the coefficient another name."
                )
        self.unused = set(self.coefficients)
        self.operations: dict[tuple[int, int, int, float], int] = {}

    def program(self) -> FloatArray:
        try:
            with warnings.catch_warnings(action="ignore"):  # of text that is next to a formula, such as 1if
                tree = ast.parse(self.formula, mode="eval")
        except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
            said = getattr(error, "msg", None) or "it is nested too deep"
            raise InputError(f"The energy {self.said} is not a formula: {said}.") from error
        try:
            result = self.part(tree.body)
        except (ArithmeticError, RecursionError) as error:
            raise InputError(f"The energy {self.said} cannot be evaluated: {error}.") from error
        if self.unused:
            raise InputError(
                f"The energy {self.said} does not use the coefficient {min(self.unused)!r}: remove it."
            )
        if isinstance(result, float):
            raise InputError(f"The energy {self.said} does not depend on the deformation.")
        if len(self.operations) > MOST_OPERATIONS:
            raise InputError(
                f"The energy {self.said} needs {len(self.operations)} operations, more than "
                f"{MOST_OPERATIONS}: simplify it."
            )
        return np.array(list(self.operations), dtype=np.float64)

    def part(self, node: ast.expr) -> float | int:
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return finite("a number of the energy", node.value)
        if isinstance(node, ast.Name):
            return self.name(node.id)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            inner = self.part(node.operand)
            return inner if isinstance(node.op, ast.UAdd) else self.times(inner, -1.0)
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            return self.power(self.part(node.left), self.part(node.right))
        if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
            code, fold = _BINARY[type(node.op)]
            return self.binary(code, fold, self.part(node.left), self.part(node.right))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
            return self.function(node.func.id, [self.part(argument) for argument in node.args])
        raise InputError(
            f"The energy {self.said} may hold numbers, names, + - * / ** and {', '.join(FUNCTIONS)}: "
            f"got {ast.unparse(node)!r}."
        )

    def name(self, name: str) -> float | int:
        if name in VARIABLES:
            return self.operation(VARIABLE, VARIABLES.index(name))
        if name in self.coefficients:
            self.unused.discard(name)
            return self.coefficients[name]
        raise InputError(
            f"The energy {self.said} uses {name!r}, which is neither one of {', '.join(VARIABLES)} "
            "nor a coefficient: give its value."
        )

    def binary(
        self, code: int, fold: Callable[[float, float], float], left: float | int, right: float | int
    ) -> float | int:
        if isinstance(left, float) and isinstance(right, float):
            return fold(left, right)
        if isinstance(left, float):
            if code == SUBTRACT:
                return self.shifted(self.times(right, -1.0), left)
            if code == DIVIDE:
                return self.times(self.power(right, -1.0), left)
            return self.times(right, left) if code == MULTIPLY else self.shifted(right, left)
        if isinstance(right, float):
            if code in (ADD, SUBTRACT):
                return self.shifted(left, right if code == ADD else -right)
            return self.times(left, right if code == MULTIPLY else 1.0 / right)
        return self.operation(code, left, right)

    def times(self, part: float | int, factor: float) -> float | int:
        return part * factor if isinstance(part, float) else self.operation(SCALE, part, constant=factor)

    def shifted(self, part: float | int, by: float) -> float | int:
        return part + by if isinstance(part, float) else self.operation(SHIFT, part, constant=by)

    def power(self, base: float | int, exponent: float | int) -> float | int:
        if not isinstance(exponent, float):
            raise InputError(
                f"An exponent in the energy {self.said} must be a number: write exp(b * log(a))."
            )
        if isinstance(base, float):
            folded = base**exponent
            return finite("a power in the energy", folded if isinstance(folded, float) else np.nan)
        return self.operation(POWER, base, constant=exponent)

    def function(self, name: str, arguments: list[float | int]) -> float | int:
        if name not in FUNCTIONS or len(arguments) != 1:
            raise InputError(
                f"The energy {self.said} calls {name} with {len(arguments)} argument(s): "
                f"only {', '.join(FUNCTIONS)} of one argument can be used."
            )
        argument = arguments[0]
        if name == "sqrt":
            return self.power(argument, 0.5)
        if isinstance(argument, float):
            with np.errstate(all="ignore"):
                return finite(f"{name} of a number", float(getattr(np, name)(argument)))
        return self.operation(LOG if name == "log" else EXP, argument)

    def operation(self, code: int, left: int, right: int = 0, constant: float = 0.0) -> int:
        """Return the number of an operation; one that was met before is not done twice."""
        return self.operations.setdefault((code, left, right, constant), len(self.operations))


@njit(cache=True)
def _start(variable, x, result):  # type: ignore[no-untyped-def]
    """Write one of `VARIABLES` with its derivatives."""
    result[:] = 0.0
    if variable < 6:
        axis = variable % 3
        share = 1.0 / 3.0 if variable >= 3 else 0.0  # lambda_a = exp(x_a + ln J / 3)
        value = np.exp(x[axis] + share * x[3])
        result[0], result[1 + axis], result[4] = value, value, share * value
        result[SECOND[axis, axis]] = value
        result[SECOND[axis, 3]], result[SECOND[3, 3]] = share * value, share * share * value
    elif variable == 6:
        result[0] = result[4] = result[SECOND[3, 3]] = np.exp(x[3])
    else:
        sign = 2.0 if variable == 7 else -2.0  # I2 is the sum of lambdabar^-2, since their product is 1
        for axis in range(3):
            square = np.exp(sign * x[axis])
            result[0] += square
            result[1 + axis] = sign * square
            result[SECOND[axis, axis]] = sign * sign * square


@njit(cache=True)
def _chain(inner, value, first, second, result):  # type: ignore[no-untyped-def]
    """Write f(inner) from f, f' and f'' there."""
    result[0] = value
    for k in range(4):
        result[1 + k] = first * inner[1 + k]
    for k in range(10):
        result[5 + k] = first * inner[5 + k] + second * inner[1 + ROW[k]] * inner[1 + COLUMN[k]]


@njit(cache=True)
def _product(left, right, result):  # type: ignore[no-untyped-def]
    result[0] = left[0] * right[0]
    for k in range(4):
        result[1 + k] = left[0] * right[1 + k] + right[0] * left[1 + k]
    for k in range(10):
        i, j = 1 + ROW[k], 1 + COLUMN[k]
        mixed = left[i] * right[j] + left[j] * right[i]
        result[5 + k] = left[0] * right[5 + k] + right[0] * left[5 + k] + mixed


@njit(cache=True, error_model="numpy")
def differentiate(operations, count, x, results):  # type: ignore[no-untyped-def]
    """Energy with gradient and Hessian with respect to x.

    Numbers are copied one by one: for an assignment between arrays Numba compiles code that words an error
    about their shapes, which takes seconds.
    """
    spare = results[count]
    for n in range(count):
        start = OPERATION_SIZE * n
        code, constant = int(operations[start]), operations[start + 3]
        left, right = results[int(operations[start + 1])], results[int(operations[start + 2])]
        result = results[n]
        if code == VARIABLE:
            _start(int(operations[start + 1]), x, result)
        elif code == ADD:
            for k in range(CARRIED):
                result[k] = left[k] + right[k]
        elif code == SUBTRACT:
            for k in range(CARRIED):
                result[k] = left[k] - right[k]
        elif code == MULTIPLY:
            _product(left, right, result)
        elif code == DIVIDE:
            inverse = 1.0 / right[0]
            _chain(right, inverse, -(inverse**2), 2.0 * inverse**3, spare)
            _product(left, spare, result)
        elif code == SCALE:
            for k in range(CARRIED):
                result[k] = constant * left[k]
        elif code == SHIFT:
            for k in range(CARRIED):
                result[k] = left[k]
            result[0] += constant
        elif code == POWER:
            power = left[0] ** constant
            first = constant * power / left[0] if left[0] != 0.0 else constant * left[0] ** (constant - 1.0)
            second = constant * (constant - 1.0)
            if second != 0.0:
                second *= left[0] ** (constant - 2.0)
            _chain(left, power, first, second, result)
        elif code == LOG:
            inverse = 1.0 / left[0]
            _chain(left, np.log(left[0]), inverse, -inverse * inverse, result)
        else:
            exponential = np.exp(left[0])
            _chain(left, exponential, exponential, exponential, result)

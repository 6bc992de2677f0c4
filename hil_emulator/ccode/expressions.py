"""Translates an expression of the model's text to C, with its type.

The order of evaluation is that of Python, so that both round alike.
"""

import ast
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from hil_emulator.ccode.c_types import (
    BOOL,
    INT,
    REAL,
    CType,
    Numbers,
    Record,
    Records,
    Several,
    TranslationError,
    c_name,
)

_ATOM, _UNARY = 16, 14
_BINARY: dict[type[ast.operator], tuple[str, int]] = {
    ast.Mult: ("*", 13), ast.Div: ("/", 13), ast.Add: ("+", 12), ast.Sub: ("-", 12),
}  # fmt: skip
_COMPARED: dict[type[ast.cmpop], tuple[str, int]] = {
    ast.Lt: ("<", 10), ast.LtE: ("<=", 10), ast.Gt: (">", 10), ast.GtE: (">=", 10),
    ast.Eq: ("==", 9), ast.NotEq: ("!=", 9),
}  # fmt: skip
_AND, _OR, _CHOICE = 5, 4, 3

_MATH = frozenset(
    ("sqrt", "exp", "expm1", "log", "log2", "log10", "log1p", "pow", "sin", "cos", "tan", "asin",
     "acos", "atan", "atan2", "sinh", "cosh", "tanh", "copysign", "floor", "ceil", "hypot", "fmod")
)  # fmt: skip
"""Functions with the same name in `math` and in C."""


@dataclass(frozen=True)
class Expression:
    """An expression in C.

    Attributes:
        text: text in C.
        kind: type of the value.
        binds: precedence of the outermost operator.

    """

    text: str
    kind: CType
    binds: int = _ATOM

    def within(self, binds: int) -> str:
        """Return the text as operand of an operator of precedence `binds`, bracketed if needed."""
        return self.text if self.binds >= binds else f"({self.text})"


class Surroundings(Protocol):
    """Functions and constants outside of the translated function."""

    single: bool

    def call(
        self, name: str, scope: Mapping[str, Any], arguments: Sequence[Expression]
    ) -> Expression:
        """Return the call of another function of the model."""

    def constant(self, name: str, scope: Mapping[str, Any]) -> Expression:
        """Return a constant of a module."""


class Expressions(ast.NodeVisitor):
    """Translates the expressions of one function.

    Args:
        program: functions and constants outside of the function.
        scope: globals of the function's module.
        local: arguments and variables by name; variables are added during translation.

    """

    def __init__(
        self, program: Surroundings, scope: Mapping[str, Any], local: dict[str, CType]
    ) -> None:
        self.program = program
        self.scope = scope
        self.local = local

    def value(self, node: ast.expr) -> Expression:
        """Return an expression in C.

        Raises:
            TranslationError: if the expression cannot be translated.

        """
        translated: Expression = self.visit(node)
        return translated

    def generic_visit(self, node: ast.AST) -> Any:
        """Refuse a kind of expression without a translation."""
        raise TranslationError(f"line {getattr(node, 'lineno', '?')}: '{ast.unparse(node)}'")

    def visit_Constant(self, node: ast.Constant) -> Expression:
        """Write a literal."""
        return self._literal(node.value)

    def _literal(self, value: object) -> Expression:
        if isinstance(value, bool):
            return Expression(str(value).lower(), BOOL)
        if isinstance(value, int):
            return Expression(str(value), INT)
        if isinstance(value, float):
            return Expression(literal(value, self.program.single), REAL)
        raise TranslationError(f"constant {value!r}")

    def visit_Name(self, node: ast.Name) -> Expression:
        """Name a variable, or a constant of the module."""
        if node.id in self.local:
            return Expression(c_name(node.id), self.local[node.id])
        return self.program.constant(node.id, self.scope)

    def visit_Attribute(self, node: ast.Attribute) -> Expression:
        """Take a field of a record, or a constant of `math`."""
        if ast.unparse(node.value) == "math":
            return self._literal(float(getattr(math, node.attr)))
        owner = self.value(node.value)
        if isinstance(owner.kind, Several):
            return Expression(
                f"{owner.text}.{c_name(node.attr)}", dict(owner.kind.fields)[node.attr]
            )
        if not isinstance(owner.kind, Record):
            self.generic_visit(node)
        assert isinstance(owner.kind, Record)
        length = dict(owner.kind.fields)[node.attr]
        # an element of an array is written &x[i]; its field x[i].f
        whole = owner.text.removeprefix("&")
        arrow = "." if whole != owner.text else "->"
        kind = REAL if length == 1 else Numbers((length,))
        return Expression(f"{whole}{arrow}{c_name(node.attr)}", kind)

    def visit_Subscript(self, node: ast.Subscript) -> Expression:
        """Translate an element, a row, or a slice from an element on."""
        owner, place = self.value(node.value), node.slice
        if isinstance(place, ast.Slice):
            return self._from(owner, place)
        if isinstance(owner.kind, Records):
            return Expression(f"&{owner.text}[{self.value(place).text}]", owner.kind.of, _UNARY)
        if not isinstance(owner.kind, Numbers):
            self.generic_visit(node)
        assert isinstance(owner.kind, Numbers)
        places = place.elts if isinstance(place, ast.Tuple) else [place]
        left = owner.kind.shape[len(places) :]
        text = owner.text + "".join(f"[{self.value(p).text}]" for p in places)
        return Expression(
            text, Numbers(left, owner.kind.of, owner.kind.fixed) if left else owner.kind.of
        )

    def _from(self, owner: Expression, place: ast.Slice) -> Expression:
        if not isinstance(owner.kind, Records):
            raise TranslationError(f"a part of '{owner.text}', which is no array of records")
        if place.lower is None:
            return owner
        return Expression(f"{owner.text} + {self.value(place.lower).within(13)}", owner.kind, 12)

    def visit_BinOp(self, node: ast.BinOp) -> Expression:
        """Write an arithmetic operation."""
        left, right = self.value(node.left), self.value(node.right)
        both = INT if left.kind == right.kind == INT else REAL
        if isinstance(node.op, ast.Pow):
            return Expression(f"{self._math('pow')}({left.text}, {right.text})", REAL)
        if isinstance(node.op, ast.Mod):
            return Expression(f"modulo({left.text}, {right.text})", REAL)
        if type(node.op) not in _BINARY:
            self.generic_visit(node)
        sign, binds = _BINARY[type(node.op)]
        before = left.within(binds)
        if isinstance(node.op, ast.Div) and both is INT:
            before, both = (
                f"({'float' if self.program.single else 'double'}){left.within(14)}",
                REAL,
            )
        return Expression(f"{before} {sign} {right.within(binds + 1)}", both, binds)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> Expression:
        """Write a sign or a negation."""
        operand = self.value(node.operand)
        if isinstance(node.op, ast.Not):
            return Expression(f"!{operand.within(_UNARY)}", BOOL, _UNARY)
        if not isinstance(node.op, ast.USub):
            self.generic_visit(node)
        return Expression(f"-{operand.within(_UNARY + 1)}", operand.kind, _UNARY)

    def visit_Compare(self, node: ast.Compare) -> Expression:
        """Write one comparison or a chain of them."""
        values = [self.value(each) for each in (node.left, *node.comparators)]
        parts = []
        for before, operator, after in zip(values, node.ops, values[1:], strict=False):
            if type(operator) not in _COMPARED:
                self.generic_visit(node)
            sign, binds = _COMPARED[type(operator)]
            parts.append(Expression(
                f"{before.within(binds + 1)} {sign} {after.within(binds + 1)}", BOOL, binds
            ))  # fmt: skip
        return parts[0] if len(parts) == 1 else _joined(parts, "&&", _AND)

    def visit_BoolOp(self, node: ast.BoolOp) -> Expression:
        """Write "and" and "or"."""
        parts = [self.value(each) for each in node.values]
        return _joined(parts, *(("&&", _AND) if isinstance(node.op, ast.And) else ("||", _OR)))

    def visit_IfExp(self, node: ast.IfExp) -> Expression:
        """Write a choice."""
        asked, yes, no = (self.value(each) for each in (node.test, node.body, node.orelse))
        text = f"{asked.within(_OR)} ? {yes.within(_CHOICE)} : {no.within(_CHOICE)}"
        return Expression(text, INT if yes.kind == no.kind == INT else yes.kind, _CHOICE)

    def visit_Call(self, node: ast.Call) -> Expression:
        """Write a call: of Python's own functions, of `math`, or of the model."""
        if node.keywords:
            self.generic_visit(node)
        arguments = [self.value(each) for each in node.args]
        if isinstance(node.func, ast.Attribute):
            if ast.unparse(node.func.value) != "math":
                self.generic_visit(node)
            return self._of_math(node.func.attr, arguments)
        name = ast.unparse(node.func)
        if name in ("max", "min"):
            return self._extreme(name, arguments)
        if name == "abs":
            return Expression(f"{self._math('fabs')}({arguments[0].text})", REAL)
        if name == "int":
            return Expression(f"(int){arguments[0].within(_UNARY)}", INT, _UNARY)
        if name == "len":
            return _length(arguments[0])
        if name == "as_floats":
            return self._as_floats(arguments[0])
        return self.program.call(name, self.scope, arguments)

    def _math(self, name: str) -> str:
        return f"{name}f" if self.program.single else name

    def _of_math(self, name: str, arguments: Sequence[Expression]) -> Expression:
        given = ", ".join(a.text for a in arguments)
        if name == "isnan":
            return Expression(f"isnan({given})", BOOL)
        if name not in _MATH:
            raise TranslationError(f"math.{name}")
        return Expression(f"{self._math(name)}({given})", REAL)

    def _as_floats(self, records: Expression) -> Expression:
        """Access the memory of records as numbers."""
        real = "float" if self.program.single else "double"
        return Expression(f"({real} *){records.within(_UNARY)}", Numbers((None,)), _UNARY)

    def _extreme(self, name: str, arguments: Sequence[Expression]) -> Expression:
        if all(a.kind == INT for a in arguments):
            if name == "max" or len(arguments) != 2:
                raise TranslationError("the larger of integers")
            return Expression(f"smaller({arguments[0].text}, {arguments[1].text})", INT)
        word = "maximum" if name == "max" else "minimum"
        text = arguments[0].text
        for other in arguments[1:]:
            text = f"{word}({text}, {other.text})"
        return Expression(text, REAL)


def literal(value: float, single: bool) -> str:
    """Return a literal that C reads as exactly the given number."""
    if math.isinf(value):
        return "INFINITY" if value > 0.0 else "-INFINITY"
    if math.isnan(value):
        return "NAN"
    return f"{value!r}f" if single else repr(value)


def _joined(parts: Sequence[Expression], sign: str, binds: int) -> Expression:
    return Expression(f" {sign} ".join(part.within(binds + 1) for part in parts), BOOL, binds)


def _length(array: Expression) -> Expression:
    if not isinstance(array.kind, Numbers):
        raise TranslationError(f"the length of '{array.text}'")
    length = array.kind.shape[0]
    return Expression(f"{array.text}_length" if length is None else str(length), INT)

"""Translates a function of the model's text to C."""

import ast
from collections.abc import Mapping
from typing import Any

from hil_emulator.ccode.c_types import (
    INT,
    NOTHING,
    REAL,
    CType,
    Numbers,
    Several,
    TranslationError,
    c_name,
    declared,
    several_reals,
)
from hil_emulator.ccode.expressions import Expression, Expressions, Surroundings

_INDENT = "    "
_AUGMENTED: dict[type[ast.operator], str] = {
    ast.Add: "+=", ast.Sub: "-=", ast.Mult: "*=", ast.Div: "/=",
}  # fmt: skip


class Statements:
    """Translates the body of one function.

    A variable is declared at its first assignment; if it is used outside of that block, before it.

    Args:
        program: functions and constants outside of the function.
        scope: globals of the function's module.
        takes: types of the arguments by name.

    Attributes:
        lines: lines of the body.
        gives: type of the result.

    """

    def __init__(
        self, program: Surroundings, scope: Mapping[str, Any], takes: Mapping[str, CType]
    ) -> None:
        self._local = dict(takes)
        self._expressions = Expressions(program, scope, self._local)
        self._real = "float" if program.single else "double"
        self._blocks: list[list[ast.stmt]] = []
        self._ahead: list[str] = []
        self._results = 0
        self.lines: list[str] = []
        self.gives: CType = NOTHING

    def body(self, function: ast.FunctionDef) -> None:
        """Translate all statements of a function."""
        self._blocks.append(function.body)
        for statement in function.body:
            start = len(self.lines)
            self._translate(statement)
            self.lines[start:start] = self._ahead
            self._ahead = []

    def _translate(self, statement: ast.stmt) -> None:
        translate = getattr(self, f"_{type(statement).__name__.lower()}", None)
        if translate is None:
            raise TranslationError(f"line {statement.lineno}: '{ast.unparse(statement)}'")
        translate(statement)

    def _write(self, text: str) -> None:
        self.lines.append(f"{_INDENT * len(self._blocks)}{text}")

    def _value(self, node: ast.expr) -> Expression:
        return self._expressions.value(node)

    def _expr(self, statement: ast.Expr) -> None:
        value = statement.value
        if isinstance(value, ast.Constant) and isinstance(value.value, str):
            return
        self._write(f"{self._value(value).text};")

    def _continue(self, statement: ast.Continue) -> None:
        self._write("continue;")

    def _return(self, statement: ast.Return) -> None:
        if isinstance(statement.value, ast.Tuple):
            parts = [self._value(each).text for each in statement.value.elts]
            self.gives = several_reals(len(parts))
            self._write(f"return ({self.gives.name}){{{', '.join(parts)}}};")
        elif statement.value is not None:
            value = self._value(statement.value)
            # a law that returns 0 in one case and 0.5 in another returns real numbers
            if self.gives != REAL:
                self.gives = value.kind
            self._write(f"return {value.text};")

    def _assign(self, statement: ast.Assign) -> None:
        if len(statement.targets) != 1:
            raise TranslationError(f"line {statement.lineno}: '{ast.unparse(statement)}'")
        (target,) = statement.targets
        if not isinstance(target, ast.Tuple):
            self._set(target, self._value(statement.value))
        elif isinstance(statement.value, ast.Tuple):
            self._one_by_one(target, statement.value)
        else:
            self._unpack(target, self._value(statement.value))

    def _annassign(self, statement: ast.AnnAssign) -> None:
        assert statement.value is not None
        self._set(statement.target, self._value(statement.value))

    def _augassign(self, statement: ast.AugAssign) -> None:
        target, value = self._value(statement.target), self._value(statement.value)
        self._write(f"{target.text} {_AUGMENTED[type(statement.op)]} {value.text};")

    def _one_by_one(self, targets: ast.Tuple, values: ast.Tuple) -> None:
        written = {ast.unparse(t) for t in targets.elts}
        for later in values.elts[1:]:
            if written & {ast.unparse(n) for n in ast.walk(later) if isinstance(n, ast.expr)}:
                raise TranslationError(f"line {targets.lineno}: values that depend on each other")
        for target, value in zip(targets.elts, values.elts, strict=True):
            self._set(target, self._value(value))

    def _unpack(self, targets: ast.Tuple, value: Expression) -> None:
        if not isinstance(value.kind, Several):
            raise TranslationError(f"line {targets.lineno}: '{value.text}' is no tuple")
        text = value.text
        if not text.isidentifier():
            self._results += 1
            text = "result" if self._results == 1 else f"result_{self._results}"
            self._write(f"const {declared(value.kind, text, self._real)} = {value.text};")
        for target, (name, kind) in zip(targets.elts, value.kind.fields, strict=True):
            if ast.unparse(target) != "_":
                self._set(target, Expression(f"{text}.{c_name(name)}", kind))

    def _set(self, target: ast.expr, value: Expression) -> None:
        if isinstance(target, ast.Subscript) and isinstance(target.slice, ast.Slice):
            self._fill(self._value(target.value), value)
            return
        if not isinstance(target, ast.Name) or target.id in self._local:
            self._write(f"{self._value(target).text} = {value.text};")
            return
        name = c_name(target.id)
        self._local[target.id] = value.kind
        declaration = declared(value.kind, name, self._real)
        if self._outlives(target.id):
            self._ahead.append(f"{_INDENT}{declaration};")
            declaration = name
        self._write(f"{declaration} = {value.text};")

    def _outlives(self, name: str) -> bool:
        """Return whether a variable is used outside of the block that is being translated."""
        return _uses(self._blocks[0], name) > _uses(self._blocks[-1], name)

    def _fill(self, array: Expression, value: Expression) -> None:
        if not isinstance(array.kind, Numbers):
            raise TranslationError(f"'{array.text}' cannot be filled")
        self._write(f"for (int i = 0; i < {array.kind.shape[0]}; i++) {{")
        self._write(f"{_INDENT}{array.text}[i] = {value.text};")
        self._write("}")

    def _if(self, statement: ast.If, leading: str = "") -> None:
        self._write(f"{leading}if ({self._value(statement.test).text}) {{")
        self._inside(statement.body)
        rest = statement.orelse
        if len(rest) == 1 and isinstance(rest[0], ast.If):
            self._if(rest[0], "} else ")
            return
        if rest:
            self._write("} else {")
            self._inside(rest)
        self._write("}")

    def _for(self, statement: ast.For) -> None:
        name = ast.unparse(statement.target)
        name = "_k" if name == "_" else name
        given = statement.iter
        if not (isinstance(given, ast.Call) and ast.unparse(given.func) == "range"):
            raise TranslationError(f"line {statement.lineno}: a loop over no range")
        bounds = [self._value(each).text for each in given.args]
        start, end = ("0", bounds[0]) if len(bounds) == 1 else bounds[:2]
        step = bounds[2] if len(bounds) == 3 else "1"
        sign = ">" if step.startswith("-") else "<"
        onwards = {"1": "++", "-1": "--"}.get(step, f" += {step}")
        i = c_name(name)
        self._local[name] = INT
        self._write(f"for (int {i} = {start}; {i} {sign} {end}; {i}{onwards}) {{")
        self._inside(statement.body)
        self._write("}")
        del self._local[name]

    def _while(self, statement: ast.While) -> None:
        self._write(f"while ({self._value(statement.test).text}) {{")
        self._inside(statement.body)
        self._write("}")

    def _inside(self, statements: list[ast.stmt]) -> None:
        self._blocks.append(statements)
        for statement in statements:
            self._translate(statement)
        self._blocks.pop()


def _uses(statements: list[ast.stmt], name: str) -> int:
    nodes = (node for statement in statements for node in ast.walk(statement))
    return sum(isinstance(node, ast.Name) and node.id == name for node in nodes)

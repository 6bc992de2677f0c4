"""The model's required functions in C, each after the functions that it calls."""

import ast
import inspect
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hil_emulator.ccode.c_types import (
    INT,
    REAL,
    CType,
    Numbers,
    Several,
    TranslationError,
    c_name,
    declared,
)
from hil_emulator.ccode.expressions import Expression, literal
from hil_emulator.ccode.statements import Statements
from hil_emulator.model.kernel import Kernel


@dataclass(frozen=True)
class Made:
    """A translated function: its name in C, argument types and result type."""

    name: str
    takes: tuple[CType, ...]
    gives: CType


class Translation:
    """The required part of the model in C.

    Args:
        kernel: the model, made with `compiled=False`.
        single: whether to use float instead of double.

    Attributes:
        texts: C text of the functions, in order of definition.
        constants: C text of the constants by name.
        structures: structures of named tuples and of results of several values, by name.

    """

    def __init__(self, kernel: Kernel, *, single: bool = False) -> None:
        self.single = single
        self.texts: list[str] = []
        self.constants: dict[str, str] = {}
        self.structures: dict[str, Several] = {}
        self._scope: dict[str, Any] = kernel.tick.__globals__
        parsed = ast.parse(kernel.source).body
        self._source = {node.name: node for node in parsed if isinstance(node, ast.FunctionDef)}
        self._made: dict[tuple[Any, ...], Made] = {}

    def need(self, name: str, *takes: CType) -> None:
        """Translate a function of the model and all that it calls.

        Args:
            name: name of the function.
            takes: types of its arguments.

        Raises:
            TranslationError: if a function cannot be translated; the message names the place.

        """
        self._function(name, self._scope[name], takes)

    def need_function(self, function: Callable[..., Any], *takes: CType) -> None:
        """Translate a function outside of the model's text, as `need` does."""
        self._function(function.__name__, function, takes)

    def call(
        self, name: str, scope: Mapping[str, Any], arguments: Sequence[Expression]
    ) -> Expression:
        """Return the call of a function, or of a named tuple."""
        if name not in scope:
            raise TranslationError(f"'{name}()', which the model does not define")
        called = scope[name]
        kinds = tuple(a.kind for a in arguments)
        if isinstance(called, type):
            made = self.named_tuple(called, kinds)
            return Expression(f"({made.name}){{{', '.join(a.text for a in arguments)}}}", made)
        function = self._function(name, called, kinds)
        given = ", ".join(text for a in arguments for text in _passed(a))
        return Expression(f"{function.name}({given})", function.gives)

    def constant(self, name: str, scope: Mapping[str, Any]) -> Expression:
        """Return a constant of a module: an integer or a floating-point number."""
        value = scope.get(name)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise TranslationError(f"'{name}', which is no number")
        whole = isinstance(value, int)
        text = str(value) if whole else literal(value, self.single)
        plain = name.lstrip("_")
        # modules may use one name for different numbers
        same = self.constants.setdefault(plain, text) == text
        return Expression(plain if same else text, INT if whole else REAL)

    def named_tuple(self, made: type, kinds: Sequence[CType]) -> Several:
        """Return the structure of a named tuple.

        Args:
            made: the tuple's class.
            kinds: types of its fields.

        Raises:
            TranslationError: if there is another structure of this name.

        """
        name = f"{c_name(made.__name__).lower()}_parts"
        fields = tuple(zip(made._fields, kinds, strict=True))  # type: ignore[attr-defined]
        structure = Several(name, fields)
        if self.structures.setdefault(name, structure) != structure:
            raise TranslationError(f"two tuples called {made.__name__}")
        return structure

    def _function(self, name: str, function: Callable[..., Any], takes: Sequence[CType]) -> Made:
        # a function called with different record types becomes one C function for each
        key = (function, *takes)
        if key not in self._made:
            self._made[key] = self._translate(name, function, takes)
        return self._made[key]

    def _translate(self, name: str, function: Callable[..., Any], takes: Sequence[CType]) -> Made:
        source = self._source_of(function)
        arguments = dict(zip((a.arg for a in source.args.args), takes, strict=True))
        translated = Statements(self, function.__globals__, arguments)
        try:
            translated.body(source)
        except TranslationError as error:
            raise TranslationError(f"{name}: {error}") from None
        if isinstance(translated.gives, Several):
            self.structures.setdefault(translated.gives.name, translated.gives)
        c_function = self._free_name(name)
        real = "float" if self.single else "double"
        given = ", ".join(text for a in arguments.items() for text in _parameter(*a, real))
        head = f"static INLINE {declared(translated.gives, c_function, real)}({given})"
        self.texts.append("\n".join([*_comment(source), head, "{", *translated.lines, "}"]))
        return Made(c_function, tuple(takes), translated.gives)

    def _source_of(self, function: Callable[..., Any]) -> ast.FunctionDef:
        if function.__globals__ is self._scope:
            return self._source[function.__name__]
        (node,) = ast.parse(textwrap.dedent(inspect.getsource(function))).body
        if not isinstance(node, ast.FunctionDef):
            raise TranslationError(f"'{function.__name__}' is no plain function")
        return node

    def _free_name(self, name: str) -> str:
        taken = [made.name for made in self._made.values()]
        free, count = c_name(name), 2
        while free in taken:
            free, count = f"{c_name(name)}_{count}", count + 1
        return free


def _passed(argument: Expression) -> list[str]:
    """Return an argument of a call, followed by its length if that is known at run time only."""
    unknown = isinstance(argument.kind, Numbers) and argument.kind.shape[0] is None
    return [argument.text, f"{argument.text}_length"] if unknown else [argument.text]


def _parameter(name: str, kind: CType, real: str) -> list[str]:
    declaration = declared(kind, c_name(name), real)
    unknown = isinstance(kind, Numbers) and kind.shape[0] is None
    return [declaration, f"int {c_name(name)}_length"] if unknown else [declaration]


def _comment(function: ast.FunctionDef) -> list[str]:
    """Return the docstring of a function as a comment of C."""
    docstring = ast.get_docstring(function)
    if not docstring:
        return []
    first, *others = (docstring.replace("*/", "* /") + " */").splitlines()
    return [f"/* {first}", *(f"   {line}".rstrip() for line in others)]

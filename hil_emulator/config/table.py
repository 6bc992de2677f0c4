"""Base of every table of a configuration, and the reader of quantities."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ModelWrapValidatorHandler,
    ValidationError,
    model_validator,
)

from hil_emulator.errors import brief
from hil_emulator.model.declare import Param
from hil_emulator.units import pattern, show, to_si


class StrictTable(BaseModel):
    """A table of a TOML file: frozen, without unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class DescribedTable(StrictTable):
    """A table written by hand: the text below a field is its description in the JSON Schema."""

    model_config = ConfigDict(use_attribute_docstrings=True)


@dataclass(frozen=True)
class QuantityReader:
    """Reader of one key: unit, dimension and range, or a word; and its description.

    Attributes:
        param: its declaration.
        words: values of words that are allowed instead of a quantity.

    """

    param: Param
    words: Mapping[str, float] = field(default_factory=dict)

    def __call__(self, text: object) -> float:
        """Return the value in SI.

        Raises:
            ValueError: it is not a quantity, or outside its bounds.

        """
        if isinstance(text, str) and text in self.words:
            return self.words[text]
        value = to_si(text, self.param.unit, self.example, difference=self.param.difference)
        if value not in self.words.values() and not self.param.allows(value):
            raise ValueError(f'"{brief(text)}" is outside the allowed {self.bounds}')
        return value

    @property
    def example(self) -> str:
        """A correct way to write it."""
        p = self.param
        finite = (v for v in (p.typical, p.low, p.high) if math.isfinite(v))
        return show(next(finite, 1.0), p.unit, p.shown)

    @property
    def bounds(self) -> str:
        """Smallest and largest allowed value."""
        p = self.param
        return f"{show(p.low, p.unit, p.shown)} ... {show(p.high, p.unit, p.shown)}"

    @property
    def assignment(self) -> str:
        """The example as TOML."""
        plain = self.param.unit == self.param.display_unit == "1"
        return f"{self.param.name} = " + (self.example if plain else f'"{self.example}"')

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        """Read the field by this."""
        return BeforeValidator(self).__get_pydantic_core_schema__(source, handler)

    def __get_pydantic_json_schema__(
        self, core_schema: Any, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Describe the field by this."""
        return {"anyOf": self.forms, "description": self.description}

    @property
    def forms(self) -> list[dict[str, Any]]:
        """Allowed values, as JSON Schema: text with a unit, a plain number, a word."""
        p = self.param
        text: dict[str, Any] = {"type": "string", "pattern": pattern(p.unit)}
        forms = [text | {"examples": [self.example]}]
        if p.unit == "1":
            limits = {"minimum": p.low, "maximum": p.high}
            finite = {name: limit for name, limit in limits.items() if math.isfinite(limit)}
            forms.append({"type": "number", **finite})
        return [*forms, {"enum": list(self.words)}] if self.words else forms

    @property
    def description(self) -> str:
        """Meaning, unit, bounds, default and source."""
        p = self.param
        lines = [p.meaning, f"{self.bounds}, typically {self.example}"]
        if p.default is not None:
            lines.append(f"default: {show(p.default, p.unit, p.shown)}")
        if self.words:
            lines.append(" or ".join(f'"{word}"' for word in self.words))
        return "\n".join([*lines, f"source: {p.source}"])


class TableOfWays(StrictTable):
    """A table with several ways to state a quantity, of which exactly one is allowed."""

    groups: ClassVar[tuple[frozenset[str], ...]]
    """Groups of keys that belong together."""

    ways: ClassVar[frozenset[tuple[int, ...]]]
    """Number of keys of every group, per way."""

    wanted: ClassVar[str]
    """The ways in words."""

    data_sheet: ClassVar[tuple[str, ...]] = ()
    """Keys of the way of a data sheet."""

    @model_validator(mode="wrap")
    @classmethod
    def _one_way(cls, given: Any, handler: ModelWrapValidatorHandler[Any]) -> Any:
        """Require one way; all mistakes are reported at once."""
        wrong = cls._no_way(given) if isinstance(given, dict) else None
        try:
            checked = handler(given)
        except ValidationError as error:
            if wrong is None:
                raise
            mistakes: list[Any] = [
                {"type": m["type"], "loc": m["loc"], "input": m["input"], "ctx": m.get("ctx", {})}
                for m in error.errors()
            ]
            mistakes.append({"type": "value_error", "input": given, "ctx": {"error": wrong}})
            raise ValidationError.from_exception_data(cls.__name__, mistakes) from None
        if wrong is not None:
            raise wrong
        return checked

    @classmethod
    def _no_way(cls, given: Mapping[str, Any]) -> ValueError | None:
        if tuple(len(group & given.keys()) for group in cls.groups) in cls.ways:
            return None
        present = [key for key in given if key in frozenset().union(*cls.groups)]
        return ValueError(f"give {cls.wanted}; found {', '.join(present) or 'no such key'}")

"""What requests and answers are made of: types with their limits."""

import json
from typing import Annotated, Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

MOST_OPTIONS = 16
"""Options of a fault, or settings of a request; the kind with most options has 10 (assumed)."""
MOST_COLUMNS = 64
"""Signals of a view: more than a page shows at a time (assumed)."""

Name = Annotated[str, Field(max_length=64)]
Text = Annotated[str, Field(max_length=200)]
Count = Annotated[int, Field(ge=0, le=2**53)]  # a JavaScript number holds it without loss
Word32 = Annotated[int, Field(ge=0, le=2**32 - 1)]
Number = Annotated[float, Field(allow_inf_nan=False)]
Time = Annotated[float, Field(ge=-1e9, le=1e9, description="seconds of emulator time")]
Value = Text | Annotated[int, Field(ge=-(2**64), le=2**64)] | Number


class Declared(BaseModel):
    """A part of the protocol: exactly the fields declared, of exactly these types."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, validate_by_name=True)


class Answer(Declared):
    """Done."""

    def fields(self) -> dict[str, Any]:
        """Return its fields as JSON has them; null for a number that is not finite."""
        return dict(json.loads(self.model_dump_json()))


class Request(Declared):
    """What every request has."""

    answer: ClassVar[type[Answer]] = Answer
    do: str
    id: Count | None = Field(
        default=None, description="comes back as `answer`, on the panel's stream"
    )

    @classmethod
    def verb(cls) -> str:
        """Return what stands in `do`."""
        return str(cls.model_fields["do"].default)


class WithOptions(Request):
    """A request whose further fields are declared elsewhere: parameters of faults, settings."""

    model_config = ConfigDict(extra="allow", json_schema_extra={"maxProperties": 4 + MOST_OPTIONS})
    __pydantic_extra__: dict[str, Value] = Field(init=False)

    @model_validator(mode="after")
    def _limit(self) -> Self:
        if len(self.options) > MOST_OPTIONS:
            raise ValueError(f"at most {MOST_OPTIONS} further fields")
        return self

    @property
    def options(self) -> dict[str, Any]:
        """The further fields."""
        return self.__pydantic_extra__

"""`[bus]`: the interface of the frames, and its timing."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from hil_emulator.config.table import QuantityReader
from hil_emulator.model.declare import Param

DEFAULT_BUS = {
    "interface": "socketcand_server",
    "channel": "can0",
    "host": "127.0.0.1",
    "port": 29536,
}
"""A TCP server that any process can join without root; 29536 is socketcand's port."""

BIT_RATE = Param("bit_rate", "bit/s", "bit rate of the bus", 500e3, 10e3, 1e6, "kbit/s")
FASTEST = 1_000_000
"""Default: the fastest classical CAN [bit/s]."""
TRANSMIT_QUEUE = 32
"""Frames that wait in a node; message buffers of a common controller (Bosch C_CAN) (assumed)."""


class BusTable(BaseModel):
    """Interface of the frames: settings of python-can, and these."""

    model_config = ConfigDict(extra="allow", frozen=True, use_attribute_docstrings=True)

    bit_rate: Annotated[float | None, QuantityReader(BIT_RATE)] = None
    timing: Literal["ideal", "modelled"] = "ideal"
    """ideal: frames pass at once; modelled: they take bus time and wait for arbitration"""
    transmit_queue: int = Field(default=TRANSMIT_QUEUE, ge=1, le=1024)
    """frames that can wait in a node for the bus"""

    @model_validator(mode="after")
    def _one_rate(self) -> "BusTable":
        python_can = (self.model_extra or {}).get("bitrate")
        if self.bit_rate and python_can and self.bit_rate != python_can:
            raise ValueError(
                f"bit_rate {self.bit_rate / 1e3:g} kbit/s and bitrate = {python_can} are two; "
                "a bus has one"
            )
        if self.timing == "modelled" and not (self.bit_rate or python_can):
            raise ValueError('timing = "modelled" needs bit_rate, such as "500 kbit/s"')
        return self


@dataclass(frozen=True)
class WireSettings:
    """The wire that frames go over.

    Attributes:
        bit_rate: in bit/s; None if it is not stated.
        modelled: whether timing and arbitration are modelled.
        transmit_queue: frames that can wait in a node.

    """

    bit_rate: int | None = None
    modelled: bool = False
    transmit_queue: int = TRANSMIT_QUEUE

    @property
    def assumed_bit_rate(self) -> int:
        """The bit rate, `FASTEST` by default [bit/s]."""
        return self.bit_rate or FASTEST


def split(table: BusTable) -> tuple[dict[str, Any], WireSettings]:
    """Return the arguments of `can.Bus`, and the wire."""
    arguments: dict[str, Any] = dict(table.model_extra or {})
    rate = table.bit_rate or arguments.get("bitrate")
    whole = round(rate) if isinstance(rate, int | float) else None
    return arguments, WireSettings(whole, table.timing == "modelled", table.transmit_queue)

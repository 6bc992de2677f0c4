"""Fuzzing that is guided by coverage: bytes that reach new lines are kept and mutated further.

    python -m tests.fuzz.guided frames -runs=100000

The options are libFuzzer's; a new traceback ends the process with exit code 77 and its input in a
file. Needs atheris (Linux).
"""

import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path

import atheris

from tests.fuzz.foreign_logs import foreign_logs

sys.path.append(str(Path(__file__).parents[1] / "conformance"))

with atheris.instrument_imports(include=["hil_emulator"]):
    from constant_node import READINGS, make_node
    from fuzzing import healing

    from hil_emulator.bus.socketcand import opens, parse_send
    from hil_emulator.device.dictionary import Dictionary
    from hil_emulator.device.measured import Measured
    from hil_emulator.errors import UserError
    from hil_emulator.frame import Frame
    from hil_emulator.identify.measured.formats.labview_text import read as read_lvm
    from hil_emulator.platform.paths import shipped
    from hil_emulator.units import to_si

NODE = 5
SHEET = shipped("eds/hydraulic_actuator.eds")
FILE = Path(tempfile.mkdtemp()) / "input"
NODE_UNDER_ATTACK = make_node(SHEET, NODE)
SENSES = Measured(list(READINGS.values()), [0] * len(READINGS))


def quantity(data: bytes) -> None:
    """Read a quantity of a configuration or a request."""
    to_si(data.decode("utf-8", "replace"), "Pa")


def socketcand(data: bytes) -> None:
    """Read the data of a TCP client."""
    opens(data)
    parse_send(data)


def frames(data: bytes) -> None:
    """Talk to a device: of each eleven bytes two are an identifier, one a length."""
    for frame in healing(NODE):
        NODE_UNDER_ATTACK.receive(0, [frame])
    for at in range(0, min(len(data), 1100) - 2, 11):
        can_id, length = int.from_bytes(data[at : at + 2], "big") & 0x7FF, data[at + 2] & 0x0F
        frame = Frame(can_id, data[at + 3 : at + 3 + min(length, 8)])
        NODE_UNDER_ATTACK.receive(at * 1_000_000, [frame])
        NODE_UNDER_ATTACK.publish(at * 1_000_000, SENSES)


def eds(data: bytes) -> None:
    """Read an EDS file of any maker."""
    FILE.write_bytes(data)
    Dictionary.from_eds(FILE, NODE)


def lvm(data: bytes) -> None:
    """Read a measurement of LabVIEW."""
    FILE.write_bytes(data)
    read_lvm(FILE)


def _frame(can_id: int, data: str) -> bytes:
    content = bytes.fromhex(data)
    return can_id.to_bytes(2, "big") + bytes([len(content)]) + content.ljust(8, b"\0")


TARGETS: dict[str, tuple[Callable[[bytes], None], list[bytes]]] = {
    "quantity": (quantity, [b"160 bar", b"-1.5e-3 l/(min*bar^0.5)"]),
    "socketcand": (socketcand, [b"< open vcan0 >", b"send 123 4 1a 22 3 44"]),
    "frames": (frames, [b"".join([
        _frame(0x000, "0100"), _frame(0x600 + NODE, "4018100100000000"), _frame(0x080, ""),
        _frame(0x600 + NODE, "2100100008000000"), _frame(0x600 + NODE, "00" * 8),
        _frame(0x600 + NODE, "a408100020000000"), _frame(0x600 + NODE, "a3" + "00" * 7),
        _frame(0x600 + NODE, "c608100000100000"), _frame(0x600 + NODE, "81" + "ff" * 7),
        _frame(0x200 + NODE, "e8030000"), _frame(0x7E5, "04" + "00" * 7),
    ])]),
    "eds": (eds, [sheet.read_bytes() for sheet in SHEET.parent.glob("*.eds")]),
    "lvm": (lvm, foreign_logs()["lvm"]),
}  # fmt: skip
"""What is attacked, and what to begin with, by name."""


def refused_or_read(target: Callable[[bytes], None], data: bytes) -> None:
    """Let a target have its bytes; to refuse them in words is right, any other exception is not."""
    try:
        target(data)
    except UserError:
        pass
    except ValueError:
        if target is not quantity:
            raise


def main() -> None:
    """Attack the target that is named first, with libFuzzer's options after it."""
    target, seeds = TARGETS[sys.argv.pop(1)]
    corpus = Path(tempfile.mkdtemp())
    for number, seed in enumerate(seeds):
        (corpus / str(number)).write_bytes(seed)
    warnings.simplefilter("ignore")
    atheris.Setup([*sys.argv, str(corpus)], lambda data: refused_or_read(target, data))
    atheris.Fuzz()


if __name__ == "__main__":
    main()

"""Invalid requests to the remote control: each is answered, and the loop continues."""

import json
import marshal
import random
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from hil_emulator.errors import UserError
from hil_emulator.faults.catalogue import KINDS
from hil_emulator.faults.fault import targets
from hil_emulator.protocol.dispatch import checked, json_object
from hil_emulator.protocol.rig import (
    EndRequest,
    FaultRequest,
    SetRequest,
    SignalsRequest,
    StatusRequest,
)
from hil_emulator.remote.control_server import answer_to
from hil_emulator.remote.rig_requests import rig_requests
from hil_emulator.signals.columns import columns
from hil_emulator.signals.inputs import SETTINGS

sys.path.append(str(Path(__file__).parents[1]))

from rigs import START, Bench, bench, reference

_NUMBERS = ("0", "-1", "1e-320", "1e308", "-1e308", "inf", "nan", "1e999", "9**9**8", "3", "0.5")
_UNITS = ("bar", "mm", "N", "mA", "A", "s", "ms", "%", "bar/s", "Hz", "l/min", "", "zz", "m^99")
_VALUES: tuple[Any, ...] = (
    *(0, -1, 1, 0.5, 1e308, 2**63, 10**300, 10**4000, True, None, [], {}, [[[[]]]], ""),
    *("x" * 5000, "\x00", "\ud800", "é", "position > 1 mm", "position > 1e308 mm", "a and b"),
)
_NAMES = ("start", "duration", "ramp", "probability", "seed", "condition", "node", "self", "value")


def body(chance: random.Random, do: str) -> bytes:
    """Return the body of a request: often nearly right, sometimes anything."""
    if do == "set":
        names = chance.choices([*SETTINGS, "temperature", ""], k=chance.randrange(4))
        content: Any = {name: _value(chance) for name in names}
    else:
        kind = chance.choice(KINDS)
        content = {"target": chance.choice([*targets(), *kind.targets, "node5.tpdo1", "0x185"])}
        content["kind"] = chance.choice((kind.name, chance.choice(KINDS).name))
        parameters = (*_NAMES, *(p.name for p in kind.params))
        for name in chance.choices(parameters, k=chance.randrange(4)):
            content[name] = _value(chance)
        if chance.random() < 0.1:
            content[chance.choice(("target", "kind"))] = chance.choice(_VALUES)
    text = json.dumps(content).encode()
    if chance.random() < 0.1:
        data = bytearray(text)
        data[chance.randrange(len(data))] = chance.randrange(256)
        text = bytes(data)
    return text


def _value(chance: random.Random) -> Any:
    if chance.random() < 0.7:
        return f"{chance.choice(_NUMBERS)} {chance.choice(_UNITS)}".strip()
    return chance.choice(_VALUES)


def ask(b: Bench, chance: random.Random) -> str:
    """Put one request to a rig as the server does; return what became of it."""
    verb = chance.choice(
        (
            SetRequest,
            SetRequest,
            FaultRequest,
            FaultRequest,
            FaultRequest,
            EndRequest,
            SignalsRequest,
            StatusRequest,
        )
    )
    fields: dict[str, Any] = {}
    if verb is EndRequest:
        fields["number"] = chance.choice((None, 0, 1, chance.randrange(10**6), 10**17))
    elif verb is SignalsRequest:
        fields["names"] = chance.choices([*columns(), "speed", "x" * 5000], k=chance.randrange(3))
    try:
        if verb in (SetRequest, FaultRequest):
            fields = json_object(body(chance, verb.verb()))
        line = checked(verb, fields).model_dump_json().encode()
    except UserError:
        return "refused before the loop"
    answer = answer_to(line, b.rig, rig_requests())
    assert marshal.loads(marshal.dumps(answer)) == answer, "values that are not plain"
    if str(answer.get("error")).startswith("cannot be done"):
        raise AssertionError(f"a gap in the checks: {line[:300]!r}: {answer['error'][:300]}")
    return "refused" if "error" in answer else "obeyed"


def attack(count: int, seed: int) -> int:
    """Put so many requests to rigs under way; return how many failed."""
    chance, counts = random.Random(seed), Counter[str]()
    failures: list[str] = []
    for _ in range(0, count, 1000):
        with bench(reference()) as b:
            b.tick(START)
            for n in range(min(1000, count)):
                try:
                    counts[ask(b, chance)] += 1
                    if n % 5 == 0:
                        b.tick()
                except Exception as error:
                    failures.append(f"{type(error).__name__}: {error}")
    print(dict(counts))
    print("\n".join(ascii(f) for f in sorted(set(failures))[:20]))
    return len(failures)

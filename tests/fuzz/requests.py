"""Requests to the remote control that nobody should send: each is answered, the loop goes on."""

import json
import random
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from hil_emulator.faults.catalogue import KINDS
from hil_emulator.faults.fault import targets
from hil_emulator.remote.control_server import answer_to
from hil_emulator.remote.http_server import request_of
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
        known = (*_NAMES, *(p.name for p in kind.params))
        for name in chance.choices(known, k=chance.randrange(4)):
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
    do = chance.choice(("set", "set", "fault", "fault", "fault", "end", "signals", "status"))
    request: dict[str, Any] = {"do": do}
    if do in ("set", "fault"):
        try:
            request[do] = request_of(body(chance, do))
        except ValueError:
            return "refused before the loop"
    elif do == "end":
        request["number"] = chance.choice((None, 0, 1, chance.randrange(10**6), 10**17))
    elif do == "signals":
        request["names"] = chance.choices([*columns(), "speed", "x" * 5000], k=chance.randrange(3))
    carried = json.loads(json.dumps(request))
    answer = answer_to(carried, b.rig)
    json.dumps(answer)
    if str(answer.get("error")).startswith("cannot be read"):
        raise AssertionError(f"a gap in the checks: {str(request)[:300]}: {answer['error'][:300]}")
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

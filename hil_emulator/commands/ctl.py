"""`hil-emulator ctl`: read a running emulator, inject faults, change settings."""

import shlex
from collections.abc import Sequence
from typing import Any
from urllib.parse import urlencode

import click

from hil_emulator.commands.text_table import text_table
from hil_emulator.errors import UserError
from hil_emulator.remote.client import request

_USAGE = """write one of
  status                          time and faults
  read [SIGNAL...]                values in SI
  fault TARGET KIND [NAME=VALUE...]
  end [NUMBER]                    one fault, or all
  set NAME VALUE                  supply_pressure "120 bar", external_force "500 N",
                                  wall_shift "-5 mm", ..."""


def ctl(port: int, words: Sequence[str]) -> None:
    """Send one request and print the answer.

    Raises:
        UserError: if it is refused, or no emulator answers.

    """
    match list(words):
        case ["status"]:
            _status(request(port, "GET", "/status"))
        case ["read", *names]:
            _signals(request(port, "GET", "/signals?" + urlencode([("name", n) for n in names])))
        case ["fault", target, kind, *rest]:
            body = {"target": target, "kind": kind, **_options(rest)}
            click.echo(f"fault {request(port, 'POST', '/faults', body)['number']}")
        case ["end"]:
            click.echo(f"ended {request(port, 'DELETE', '/faults')['ended']}")
        case ["end", number] if number.isdecimal():
            click.echo(f"ended {request(port, 'DELETE', f'/faults/{number}')['ended']}")
        case ["set", name, value]:
            answer = request(port, "PUT", "/settings", {name: value})
            click.echo("\n".join([f"{name} {value}", *answer.get("waits", [])]))
        case _:
            raise UserError(f"ctl {shlex.join(words)}: not understood; {_USAGE}")


def _options(words: Sequence[str]) -> dict[str, str]:
    pairs = [word.partition("=") for word in words]
    for name, equals, _ in pairs:
        if not equals:
            raise UserError(f"ctl: '{name}' is not NAME=VALUE")
    return {name: value for name, _, value in pairs}


def _status(answer: dict[str, Any]) -> None:
    click.echo(f"time {answer['time']:.3f} s, {answer['slipped']:.3f} s behind real time")
    for fault in answer["faults"]:
        click.echo(f"fault {fault['number']}  {fault['fault']}")


def _signals(answer: dict[str, Any]) -> None:
    rows = [(name, f"{s['value']:.6g}", s["unit"]) for name, s in answer["signals"].items()]
    click.echo(text_table(("signal", "value", "unit"), rows))

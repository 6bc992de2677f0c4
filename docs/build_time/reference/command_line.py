"""`command_line.md`: every command with its arguments and options."""

import click

from build_time.reference.markdown import code, page, table, text
from hil_emulator.__main__ import main
from hil_emulator.command_line.arguments import meaning
from hil_emulator.command_line.examples import EXAMPLES
from hil_emulator.command_line.group import INTERRUPTED
from hil_emulator.errors import UserError

_HEAD = """\
Every command of `hil-emulator`. Wrong input ends a command with exit code {wrong} and a message on
standard error, Ctrl-C with {interrupted}. [Running](../how_to/run.md) lists those of `run`."""

_NOT_RUN = {
    "bench": "takes a minute",
    "characterise": "takes half a minute",
    "conformance": "needs can0 and a device",
    "ctl": "needs a running emulator",
    "gap": "needs a log of a moving rod",
    "identify": "needs three logs",
}
"""What an example needs that the test of printed commands lacks, by the name of the command."""


def write() -> str:
    """Return the page."""
    head = _HEAD.format(wrong=UserError.exit_code, interrupted=INTERRUPTED)
    parts = [_command(name, command) for name, command in sorted(main.commands.items())]
    return page("Command line", head, *parts)


def _command(name: str, command: click.Command) -> str:
    context = click.Context(command, info_name=name)
    usage = " ".join(["hil-emulator", name, *command.collect_usage_pieces(context)])
    params = command.get_params(context)
    arguments = [_argument(name, p, context) for p in params if isinstance(p, click.Argument)]
    options = [_option(name, p) for p in params if isinstance(p, click.Option) and not p.hidden]
    paragraphs = [text(p) for p in (command.help or "").replace("\b\n", "").split("\n\n")]
    parts = [
        f"## {name}", *paragraphs, f"```text\n{usage}\n```",
        table(("argument", "required", "default", "meaning"), arguments) if arguments else "",
        table(("option", "value", "default", "meaning"), options),
        f"Example:\n\n{_marker(name)}```sh\n{EXAMPLES[name]}\n```",
    ]  # fmt: skip
    return "\n\n".join(part for part in parts if part)


def _marker(name: str) -> str:
    return f"<!-- not run: {_NOT_RUN[name]} -->\n" if name in _NOT_RUN else ""


def _argument(command: str, param: click.Argument, context: click.Context) -> tuple[str, ...]:
    shown = " ".join(param.get_usage_pieces(context))
    required = "yes" if param.required or param.callback else "no"
    return code(shown), required, _default(param), text(meaning(command, str(param.name)))


def _option(command: str, param: click.Option) -> tuple[str, ...]:
    if not param.help:
        raise ValueError(f"{command} {param.opts[0]} has no meaning: give it a help text")
    several = " May be repeated." if param.multiple else ""
    default = "required" if param.required else "" if param.is_flag else _default(param)
    return ", ".join(map(code, param.opts)), _value(param), default, text(param.help) + several


def _value(param: click.Option) -> str:
    """Return what follows an option; nothing follows a flag."""
    if param.is_flag:
        return ""
    if isinstance(param.type, click.Choice):
        return " or ".join(map(code, param.type.choices))
    if isinstance(param.type, click.IntRange):
        low, high = param.type.min, param.type.max
        return f"at least {low}" if high is None else f"{low} ... {high}"
    return code(param.metavar or param.type.name.upper())


def _default(param: click.Parameter) -> str:
    """Return the default; click marks a missing one by an object of its own."""
    return code(param.default) if isinstance(param.default, str | int | float) else ""

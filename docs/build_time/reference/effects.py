"""`effects.md`: the catalogue of effects."""

from itertools import groupby

from build_time.reference.markdown import code, page, sentence, shown, table, text
from hil_emulator.model.declare import Effect, Param
from hil_emulator.model.effects import CATALOGUE

_HEADER = ("parameter", "unit", "default", "typical", "bounds", "meaning", "source")


_HEAD = """\
{count} effects. The first parameter of each is its strength; at the value `off` the effect vanishes
exactly. `hil-emulator effects` prints the list. A span is the width of a channel's usual measuring
range; in a configuration such values are written in the channel's own unit."""


def write() -> str:
    """Return the page."""
    parts = [_HEAD.format(count=len(CATALOGUE))]
    for name, group in groupby(sorted(CATALOGUE, key=_table), key=_table):
        parts += [f"## Effects of [{name}]", *(effect_section(e) for e in group)]
    return page("Effects", *parts)


def _table(effect: Effect) -> str:
    return "sensors.CHANNEL" if effect.stage.table == "sensors" else effect.stage.table


def effect_section(effect: Effect) -> str:
    """Return the section of an effect from its declaration."""
    parts = [
        f"### {effect.name}",
        code(effect.equation),
        sentence(effect.words),
        table(_HEADER, [_row(p, effect) for p in effect.params]),
        f"Shows in: {text(effect.signature)}. Source: {text(effect.source)}.",
        f"Not modelled: {text(effect.not_modelled)}." if effect.not_modelled else "",
    ]
    return "\n\n".join(part for part in parts if part)


def _row(param: Param, effect: Effect) -> tuple[str, ...]:
    is_knob = param is effect.knob
    default = param.typical if param.default is None else param.default
    return (
        code(param.name), text(param.display_unit),
        f"off: {shown(param.off, param)}" if is_knob else shown(default, param),
        shown(param.typical, param), f"{shown(param.low, param)} ... {shown(param.high, param)}",
        text(param.meaning), text(param.source),
    )  # fmt: skip

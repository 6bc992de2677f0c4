"""One self-contained HTML page of a result: the verdict first, then what supports it."""

from collections.abc import Sequence
from html import escape

from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.disagreement.regions import Disagreement
from hil_emulator.identify.reporting import charts, pictures, report_tables

_STYLE = """body{font:15px/1.45 system-ui,sans-serif;max-width:62em;margin:2em auto;padding:0 1em}
h1{font-size:1.5em}h2{font-size:1.15em;margin-top:1.8em;border-bottom:1px solid #ccc}
table{border-collapse:collapse;margin:.6em 0;font-size:.88em}
td,th{padding:.15em .7em;border-bottom:1px solid #ddd;text-align:left;vertical-align:top}
th.g{text-align:center;border-bottom:1px solid #999}
td.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
.verdict{font-size:1.25em;padding:.6em 1em;background:#eef3fa;border-left:5px solid #0072b2}
.verdict.open{background:#fdf1e7;border-color:#d55e00}
.small{font-size:.85em;color:#555}img{max-width:100%}li{margin:.15em 0}
@media print{body{margin:0;max-width:none;font-size:11px}h2{break-after:avoid}
p.pic,table{break-inside:avoid}.verdict{-webkit-print-color-adjust:exact;print-color-adjust:exact}}
"""

_WORDS = {
    "missing_effects": "Missing", "nothing_missing": "Nothing is missing",
    "unknown_effect": "Something unknown is missing", "cannot_examine": "Cannot be examined",
    "agrees": "Model and measurement agree", "disagrees": "Model and measurement disagree",
}  # fmt: skip


def report(result: Result, title: str, made: str = "") -> str:
    """Return the page.

    Args:
        result: what was found.
        title: of the page.
        made: when and by what, for the provenance.

    """
    parts = [_verdict(result), *_next(result), *_where(result), *_found(result), *_size(result)]
    parts += [*_reasons(result), *_model(result), *_limits(result), _provenance(result, made)]
    return (
        f"<!doctype html><html lang=en><meta charset=utf-8><title>{escape(title)}</title>"
        f"<style>{_STYLE}</style><h1>{escape(title)}</h1>{''.join(parts)}</html>"
    )


def _verdict(result: Result) -> str:
    text = result.reason.removeprefix("missing: ")
    kind = "" if result.verdict in ("missing_effects", "nothing_missing", "agrees") else " open"
    words = f"<b>{_WORDS[result.verdict]}:</b> {escape(text)}."
    return f'<p class="verdict{kind}">{words}</p>{_shrink(result)}'


def _shrink(result: Result) -> str:
    """Return the one sentence that says how the gap shrank where it was widest."""
    best, sentence = 1.0, ""
    for channel, parts in result.gap.items():
        values = parts.get("validation") or parts["training"]
        kind = "free_" if "free_before" in values else ""
        before, after = values[f"{kind}before"], values[f"{kind}after"]
        if not result.effects or before / after <= best:
            continue
        best = before / after
        run = "0.5 s free runs" if kind else "the force balance"
        data = "data not used for the fit" if "validation" in parts else "the training data"
        floor = values.get(f"{kind}floor")
        least = f"; disturbances alone leave {floor:.3g}" if floor else ""
        sentence = (
            f"<p>In {run} on {data}, {channel.replace('_', ' ')} was {before:.3g} off and is "
            f"{after:.3g} off with it (rms, in {escape(result.measure)}{least}).</p>"
        )
    return sentence


def _next(result: Result) -> list[str]:
    if not result.next_experiment:
        return []
    return [f"<p><b>Next experiment:</b> {escape(result.next_experiment)}</p>"]


def _where(result: Result) -> list[str]:
    """Return where the gap is: traces, balances, regions, maps."""
    if not result.traces:
        return []
    both = bool(result.effects)
    parts = ["<h2>Where the gap is</h2>", _places("Balances that disagree", result.where)]
    parts.append(_image(pictures.trace(result, pictures.widest_trace(result))))
    for drawn in result.maps:
        parts.append(
            f"<p>What the balance <b>{escape(drawn.balance)}</b> lacks over "
            f"{escape(drawn.regressor)}: median and the middle two thirds.</p>"
        )
        parts.append(_image(pictures.balance(drawn, both)))
    if both and result.remaining:
        parts.append(_places("Balances that still disagree", result.remaining))
    return parts


def _places(title: str, found: Sequence[Disagreement]) -> str:
    if not found:
        return "<p>No balance disagrees beyond noise and usual disturbances.</p>"
    lines = []
    for d in found:
        places = "".join(f"<li>{escape(str(r))}</li>" for r in d.regions)
        lines.append(
            f"<li><b>{escape(d.balance)}</b> over {escape(d.regressor)}: {100 * d.share:.0f} % of "
            f"the gap<ul>{places}</ul></li>"
        )
    return f"<p>{title}:</p><ul>{''.join(lines)}</ul>"


def _found(result: Result) -> list[str]:
    parts = []
    if result.effects:
        parts += ["<h2>What is missing</h2>", report_tables.effects(result)]
        parts.append(
            '<p class="small">Share: of what laws of any form could take out of the disagreement '
            "one step ahead on the training data. Gains are in chi-square of joint refits.</p>"
        )
    if result.unknown and result.verdict not in ("agrees", "disagrees"):
        parts += _unknown(result)
    return parts


def _unknown(result: Result) -> list[str]:
    """Return the strongest unexplained term, and other readings of the same gap."""
    first, *others = sorted(result.unknown, key=lambda u: -u.statistic)
    parts = [
        f"<h2>Unexplained: {escape(first.balance)} over {escape(first.regressor)}</h2>"
        f"<p>{escape(first.shape)}; gain in chi-square {first.statistic:.0f}</p>",
        _image(pictures.term(first)),
    ]
    if others:
        lines = "".join(
            f"<li>{escape(u.balance)} over {escape(u.regressor)}: {escape(u.shape)}; gain "
            f"{u.statistic:.0f}</li>" for u in others
        )  # fmt: skip
        parts.append(f"<p>Other readings of the same gap:</p><ul>{lines}</ul>")
    if result.verdict != "unknown_effect":
        return parts
    if result.added is None:
        return [*parts, "<p>The model has no place for such a term; it is not added.</p>"]
    return [*parts, f"<p>Added to identified.toml as a table: {escape(result.added.name)}.</p>"]


def _size(result: Result) -> list[str]:
    if not result.gap:
        return []
    parts = ["<h2>The gap by channel</h2>"]
    if len(result.gap) > 1:
        parts.append(_image(charts.gap(result)))
    parts.append(report_tables.gap(result))
    words = (
        f"Root mean square of measured less predicted, in {escape(result.measure)} and in % of "
        "the channel's spread."
    )
    if result.motion:
        words += (
            " Free runs restart every 0.5 s from filtered states and are driven by the recorded "
            "current alone. Floor: what sensor noise, drift and usual disturbances leave of a "
            "model that is right in everything else; ripple and laws of another form leave more."
        )
    parts.append(f'<p class="small">{words}</p>')
    if result.motion:
        parts += ["<p>The free run by region of motion:</p>", report_tables.motion(result)]
    return parts


def _reasons(result: Result) -> list[str]:
    """Return ranking, rivals and ladder."""
    if result.search is None or not result.search.rounds or not result.search.rounds[0].scores:
        return []
    parts = ["<h2>Ranking</h2>", _image(charts.ranking(result)), report_tables.ranking(result)]
    if result.ladder:
        parts += ["<h2>Ladder</h2>", _image(charts.ladder(result))]
    return parts


def _model(result: Result) -> list[str]:
    if not result.parameters:
        return []
    parts = ["<h2>Ordinary parameters</h2>", report_tables.parameters(result)]
    final = result.search.final if result.search else None
    if final is not None and len(final.coordinates) > 1:
        parts.append(_image(charts.correlations(result)))
    return parts


def _limits(result: Result) -> list[str]:
    parts = []
    if result.unseen:
        hidden = escape(", ".join(result.unseen))
        parts.append(f"<h2>Out of sight with these data</h2><p>{hidden}</p>")
    if result.notes:
        lines = "".join(f"<li>{escape(n)}</li>" for n in result.notes)
        parts.append(f"<h2>Notes on the data</h2><ul>{lines}</ul>")
    return parts


def _provenance(result: Result, made: str) -> str:
    rows = "".join(
        f"<li>{escape(n)}: {f'sha256 {escape(d)}' if d else 'not from a file'}"
        f"{', held out' if n in result.held_out else ''}</li>"
        for n, d in result.digests.items()
    )
    return (
        f'<h2>Provenance</h2><p class="small">{escape(made)}</p><ul class="small">{rows}</ul>'
    )  # fmt: skip


def _image(png: str) -> str:
    return f'<p class="pic"><img src="data:image/png;base64,{png}" alt=""></p>'

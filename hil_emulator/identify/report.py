"""One self-contained HTML page of a result."""

from html import escape

from hil_emulator.identify import pictures
from hil_emulator.identify.result import Result
from hil_emulator.units import show

_STYLE = """body{font:15px/1.45 system-ui,sans-serif;max-width:60em;margin:2em auto;padding:0 1em}
table{border-collapse:collapse;margin:.6em 0}td,th{padding:.2em .8em;border-bottom:1px solid #ddd;
text-align:left}td.n{text-align:right;font-variant-numeric:tabular-nums}
.verdict{font-size:1.3em;padding:.6em 1em;background:#eef3fa;border-left:5px solid #4c72b0}
.flag{color:#c44e52}img{max-width:100%}"""

Row = tuple[object, ...]


def report(result: Result, title: str) -> str:
    """Return the page."""
    parts = [f'<p class="verdict">{escape(result.reason)}</p>']
    if result.next_experiment:
        parts.append(f"<p><b>Next experiment:</b> {escape(result.next_experiment)}</p>")
    if result.effects:
        parts += ["<h2>What is missing</h2>", _effects(result)]
    for i, u in enumerate(result.unknown):
        parts.append(
            f'<h2 class="flag">Unexplained: {escape(u.balance)} over {escape(u.driver)}</h2>'
            f"<p>{escape(u.shape)}; gain in chi-square {u.statistic:.0f}</p>"
        )
        parts.append(_image(pictures.term(result, i)))
    if result.gap:
        parts += ["<h2>The gap, before and after</h2>", _gap(result), _image(pictures.gap(result))]
        parts += [_image(pictures.trace(result, name)) for name in _widest(result)]
    if result.search is not None:
        parts += ["<h2>Ranking</h2>", _image(pictures.ranking(result)), _rivals(result)]
        parts += ["<h2>Ordinary parameters</h2>", _parameters(result)]
        parts.append(_image(pictures.correlations(result)))
    if result.unseen:
        hidden = escape(", ".join(result.unseen))
        parts.append(f"<h2>Out of sight with these data</h2><p>{hidden}</p>")
    if result.notes:
        lines = "".join(f"<li>{escape(n)}</li>" for n in result.notes)
        parts.append(f"<h2>Notes on the data</h2><ul>{lines}</ul>")
    return (
        f"<!doctype html><html lang=en><meta charset=utf-8><title>{escape(title)}</title>"
        f"<style>{_STYLE}</style><h1>{escape(title)}</h1>{''.join(parts)}</html>"
    )


def _image(png: str) -> str:
    return f'<p><img src="data:image/png;base64,{png}" alt=""></p>'


def _table(head: Row, rows: list[Row]) -> str:
    def cell(value: object) -> str:
        number = isinstance(value, int | float)
        text = f"{value:.4g}" if isinstance(value, float) else escape(str(value))
        return f'<td class="n">{text}</td>' if number else f"<td>{text}</td>"

    top = "".join(f"<th>{escape(str(h))}</th>" for h in head)
    body = "".join(f"<tr>{''.join(cell(v) for v in row)}</tr>" for row in rows)
    return f"<table><tr>{top}</tr>{body}</table>"


def _effects(result: Result) -> str:
    rows: list[Row] = []
    for f in result.effects:
        low, high = (show(v, f.unit, f.shown) for v in f.interval)
        flags = "its form differs" if f.form_differs else ""
        group = f"or {', '.join(f.group)}" if f.group else ""
        held = f.held_out if f.held_out is not None else "none"
        rows.append(
            (f.name, f.knob, show(f.value, f.unit, f.shown), f"{low} ... {high}",
             f"{100 * f.explained:.0f} %", f.gain, held, "; ".join(t for t in (flags, group) if t))
        )  # fmt: skip
    head = ("effect", "knob", "value", "95 %", "share", "gain", "held-out gain", "caution")
    return _table(head, rows)


def _gap(result: Result) -> str:
    rows: list[Row] = [
        (channel, part, values.get("before", float("nan")), values.get("after", float("nan")))
        for channel, parts in result.gap.items()
        for part, values in parts.items()
    ]
    return _table(
        ("channel", "data", "before", f"after (rms of one step, in {result.measure})"), rows
    )


def _rivals(result: Result) -> str:
    rows: list[Row] = [
        (f.name, r.name, r.gain, r.held_out if r.held_out is not None else "none", r.lost)
        for f in result.effects
        for r in f.rivals
    ]
    return _table(("named", "rival", "gain", "held-out", "why it lost"), rows) if rows else ""


def _parameters(result: Result) -> str:
    rows: list[Row] = [
        (name, v["configured"], v["refitted"],
         f"{100 * (v['refitted'] / v['configured'] - 1):+.1f} %" if v["configured"] else "")
        for name, v in result.parameters.items()
    ]  # fmt: skip
    return _table(("parameter [SI]", "configured", "refitted", "change"), rows)


def _widest(result: Result) -> list[str]:
    """Return the traces whose disagreement shrank most, at most three."""

    def shrunk(name: str) -> float:
        t = result.traces[name]
        return float((t["before"] ** 2).sum() - (t["after"] ** 2).sum())

    return sorted(result.traces, key=shrunk, reverse=True)[:3]

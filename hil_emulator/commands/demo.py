"""`hil-emulator demo`: a controller against the emulator, with verdict and picture."""

from pathlib import Path

import click

from hil_emulator.commands.waiting import waiting
from hil_emulator.demo.script import Demonstration, Response, perform
from hil_emulator.platform.paths import cache_folder


def demo(picture: Path, *, overwrite: bool = False) -> bool:
    """Run the demonstration, print PASS or FAIL, write the picture; return whether it passed.

    Raises:
        UserError: if the installation is incomplete or the picture exists or cannot be
            written.

    """
    with waiting("demo") as progress:
        outcome = perform(cache_folder(), progress.report)
    for response in outcome.responses:
        click.echo(_line(response))
    click.echo(verdict(outcome))
    from hil_emulator.demo.picture import draw

    draw(outcome, picture, overwrite=overwrite)
    click.echo(f"picture: {picture}")
    return outcome.passed


def _line(response: Response) -> str:
    step, wander = response.step, response.wander
    pressure = max(wander["pressure_a"], wander["pressure_b"])
    scale, unit = (1e3, "mm") if step.quantity == "position" else (1.0, "N")
    return (
        f"{'ok  ' if response.passed else 'BAD '} {step.quantity:<10} "
        f"{step.before * scale:>4.0f} -> {step.after * scale:>3.0f} {unit:<2}  "
        f"settles in {response.settling * 1e3:3.0f} ms, overshoot {response.overshoot:.1%}, "
        f"holds within {wander['position'] * 1e6:.1f} um, {pressure * 1e-5:.1f} bar rms"
    )


def verdict(outcome: Demonstration) -> str:
    """Return the verdict in one line."""
    slowest = max(r.settling for r in outcome.responses)
    widest = max(r.overshoot for r in outcome.responses)
    return (
        f"{'PASS' if outcome.passed else 'FAIL'}: settling at most {slowest * 1e3:.0f} ms, "
        f"overshoot at most {widest:.1%}, {outcome.missed} samples missed, "
        f"{outcome.emergencies} emergencies"
    )

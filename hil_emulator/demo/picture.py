"""The picture of a demonstration."""

from pathlib import Path
from typing import Any

from hil_emulator.demo.script import Demonstration, set_point
from hil_emulator.pages import drawing
from hil_emulator.pages.palette import BLUE, GREEN, GREY, VERMILION
from hil_emulator.signals.columns import MODEL


def draw(outcome: Demonstration, file: Path, *, overwrite: bool) -> None:
    """Draw set points, responses, pressures and current over time."""
    figure, axes = drawing.subplots((9, 10), 4, sharex=True)
    verdict = "PASS" if outcome.passed else "FAIL"
    figure.suptitle(f"Emulated HyQ knee under a controller on CAN: {verdict}")
    t = outcome.table["time"]
    _controlled(axes[0], outcome, "position", "position [mm]", 1e3)
    _controlled(axes[1], outcome, "load_force", "load force [N]", 1.0)
    for name, colour, label in (
        ("pressure_a", BLUE, "a, cap side"),
        ("pressure_b", VERMILION, "b, rod side"),
        ("supply_pressure", GREY, "supply"),
    ):
        axes[2].plot(t, outcome.table[name] * 1e-5, colour, lw=0.8, label=label)
    axes[2].set_ylabel("measured pressure [bar]")
    axes[3].step(t, outcome.table["valve_current"] * 1e3, GREEN, lw=0.8, where="post")
    axes[3].set_ylabel("valve current [mA]")
    axes[3].set_xlabel("emulator time [s]")
    for axis in axes:
        axis.grid(alpha=0.3)
    for axis in axes[:3]:
        axis.legend(loc="upper left", fontsize=8, ncols=3)
    drawing.save(figure, file, overwrite=overwrite)


def _controlled(axis: Any, outcome: Demonstration, quantity: str, label: str, scale: float) -> None:
    """Draw one controlled quantity: as measured, as it is, and its set point where it has one."""
    t = outcome.table["time"]
    measured, actual = outcome.table[quantity], outcome.table[MODEL + quantity]
    axis.plot(t, measured * scale, color=GREY, lw=0.5, label="measured")
    axis.plot(t, actual * scale, BLUE, lw=1.2, label="model")
    wanted = [target * scale if kind == quantity else None for kind, target in map(set_point, t)]
    shown = [float("nan") if w is None else w for w in wanted]
    axis.plot(t, shown, VERMILION, ls="--", label="set")
    for response in outcome.responses:
        if response.step.quantity == quantity:
            axis.annotate(
                f"{response.settling * 1e3:.0f} ms, {response.overshoot:.0%} over",
                (response.step.end, response.step.after * scale),
                xytext=(-6, 6),
                textcoords="offset points",
                fontsize=8,
                ha="right",
            )
    axis.set_ylabel(label)
    axis.margins(y=0.2)

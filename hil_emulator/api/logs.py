"""Recorded data of every kind as experiments: tables, the emulator's journals, CAN captures."""

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from hil_emulator.bus import log_endings
from hil_emulator.bus.log_content import content, plain
from hil_emulator.captures.carrier import Carrier
from hil_emulator.config.load import Configuration
from hil_emulator.config.one_supply import supply_effects
from hil_emulator.errors import UserError
from hil_emulator.identify.measured import bus_logging, formats
from hil_emulator.identify.measured.data import experiments as experiments_of
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.measured.formats.table import LogColumn, LogTable, label
from hil_emulator.identify.measured.reading import MeasuredFile, digest_of, recording
from hil_emulator.identify.measured.stated import Stated
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.recording import SUFFIX, journal
from hil_emulator.units import axis

ENDINGS = (*formats.ENDINGS, SUFFIX, *log_endings.SUFFIXES)
"""Endings of files that can be examined."""


@dataclass(frozen=True)
class Meaning:
    """Statements of the user about the data.

    Attributes:
        databases: DBC files with the meaning of captured frames.
        sheets: EDS and DCF files with the meaning of captured frames.
        node_ids: node-IDs of those that are EDS files, in their order.
        names: channel by its name in the data, if that differs.
        units: unit by the name in the data, if the data lack units.
        headings: names and units of the columns of files without a header.
        set_point_first: whether the current of a table's row acted before its readings; None if
            the file states it, or if it is unknown.
        rated_current: current of a set point of 100 % or full scale [A].
        full_scale: set point at the rated current [V].
        bus: channel of captures whose frames count; None for all.

    """

    databases: Sequence[Path] = ()
    sheets: Sequence[Path] = ()
    node_ids: Sequence[int] = ()
    names: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    headings: Sequence[str] = ()
    rated_current: float | None = None
    full_scale: float | None = None
    bus: str | None = None
    set_point_first: bool | None = None


def experiments(files: Sequence[Path], config: Configuration, meaning: Meaning) -> list[Experiment]:
    """Read experiments; the content of a file determines its kind.

    Args:
        files: tables, journals and captures, which may be compressed (.gz).
        config: its nodes give captured frames their meaning by default.
        meaning: statements of the user about the data.

    Raises:
        UserError: if a file cannot be used.

    """
    described = functools.cache(lambda: _carriers(config, meaning))
    experiments_read: list[Experiment] = []
    for file in files:
        if file.suffix.lower() == SUFFIX:
            experiments_read += experiments_of(_journal(file, config))
            continue
        digest = digest_of(file)
        with plain(file) as inner, axis(rotary=config.rotary):
            experiments_read += experiments_of(_measured(file, inner, digest, described, meaning))
    return experiments_read


def _measured(
    file: Path, inner: Path, digest: str, described: Callable[[], tuple[list[Carrier], int]],
    meaning: Meaning,
) -> MeasuredFile:  # fmt: skip
    """Return the content of a capture or a table.

    Args:
        file: its name.
        inner: the same unpacked.
        digest: of the file.
        described: returns what captured frames mean, and the identifier of SYNC.
        meaning: statements of the user about the data.

    """
    stated = Stated(rated_current=meaning.rated_current, full_scale=meaning.full_scale)
    if is_capture(inner):
        # slow to import, and not needed for tables
        from hil_emulator.captures import capture

        table = capture.read(inner, *described(), meaning.bus)
    else:
        table = formats.read(inner, meaning.headings)
        if bus_logging.holds_frames(table):
            from hil_emulator.captures import capture, logged_frames

            frames = logged_frames.of_table(table)
            table = capture.explained(inner, frames, *described(), meaning.bus)
        else:
            stated = replace(stated, names=meaning.names, units=meaning.units)
    return _ordered(recording(file, table, digest, stated), meaning)


def is_capture(file: Path) -> bool:
    """Return whether a file is a log of frames: by its content, or by its ending."""
    if content(file):
        return True
    ending = file.suffix.lower()
    return ending in log_endings.SUFFIXES and ending not in formats.ENDINGS


def _ordered(measured: MeasuredFile, meaning: Meaning) -> MeasuredFile:
    """Return a file with the order of set point and readings in a row that the user states.

    A file that states it itself, such as a capture with the frames of the set point, stays.
    """
    if measured.set_point_first is not None:
        return measured
    return replace(measured, set_point_first=meaning.set_point_first)


def pairs(options: Sequence[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Return channel by name, and unit by name, from options such as `position=CylPos [mm]`.

    Raises:
        UserError: for one without "=".

    """
    by_name, units = {}, {}
    for text in options:
        channel, equals, name = text.partition("=")
        if not equals or not name.strip():
            raise UserError(f'--channel {text}: write CHANNEL=NAME, such as "position=CylPos [mm]"')
        plain, unit = label(name)
        by_name[plain] = channel.strip()
        if unit is not None:
            units[plain] = unit
    return by_name, units


def _carriers(config: Configuration, meaning: Meaning) -> tuple[list[Carrier], int]:
    """Return the meaning of captured frames, and the identifier of SYNC."""
    # slow to import, too
    from hil_emulator.captures import by_database, by_dictionary
    from hil_emulator.simulation.node_factory import nodes

    carriers = [
        c for f in meaning.databases for c in by_database.from_file(f, meaning.names, meaning.units)
    ]
    carriers += by_dictionary.from_files(meaning.sheets, meaning.node_ids)
    made = nodes(config, [channel.name for channel in CHANNELS])
    sync_id = by_dictionary.sync_id(made[0].dictionary) if made else by_dictionary.SYNC
    if not carriers and not made:
        raise UserError(
            f"{config.files[-1]}: no [[node]] describes captured frames; name a --dbc or --eds"
        )
    if not carriers:
        carriers = [c for n in made for c in by_dictionary.carriers(n.dictionary, n.pdos)]
    return carriers, sync_id


def _journal(file: Path, config: Configuration) -> MeasuredFile:
    """Read a journal; refuse effects of a supply that it shared with other actuators."""
    kept = journal.read(file)
    columns = (
        LogColumn(name, kept.units[name] or "1", values) for name, values in kept.table().items()
    )
    measured = recording(file, LogTable(tuple(columns), set_point_first=True), digest_of(file))
    mates = ", ".join(kept.header.get("supply_mates", ()))
    if not mates:
        return measured
    if effects := supply_effects(config):
        raise UserError(
            f"{file}: was recorded on a supply shared with {mates}, whose flow is not in it: leave "
            f"{', '.join(effects)} out of the configuration; what the pump did is in the measured "
            "supply_pressure"
        )
    note = (
        f"supply shared with {mates}, whose flow is not known: an effect of supply or tank that is "
        "named has the size that fits this actuator's flow alone"
    )
    return replace(measured, notes=(*measured.notes, note))

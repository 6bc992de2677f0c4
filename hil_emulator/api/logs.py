"""Recorded data of every kind as experiments: tables, the emulator's journals, CAN captures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from hil_emulator.bus import log_endings
from hil_emulator.captures.carrier import Carrier
from hil_emulator.config.load import Configuration
from hil_emulator.config.one_supply import supply_effects
from hil_emulator.errors import UserError
from hil_emulator.identify.measured import formats
from hil_emulator.identify.measured.data import experiments as experiments_of
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.measured.formats.table import LogColumn, LogTable
from hil_emulator.identify.measured.reading import MeasuredFile, digest_of, read, recording
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.recording import SUFFIX, journal

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
        headings: names and units of the columns of files without a header.
        rated_current: current of a set point of 100 % [A].

    """

    databases: Sequence[Path] = ()
    sheets: Sequence[Path] = ()
    node_ids: Sequence[int] = ()
    names: Mapping[str, str] = field(default_factory=dict)
    headings: Sequence[str] = ()
    rated_current: float | None = None


def experiments(files: Sequence[Path], config: Configuration, meaning: Meaning) -> list[Experiment]:
    """Read experiments.

    Args:
        files: tables, journals and captures.
        config: its nodes give captured frames their meaning by default.
        meaning: statements of the user about the data.

    Raises:
        UserError: if a file cannot be used.

    """
    carriers, sync_id = _carriers(files, config, meaning)
    experiments_read: list[Experiment] = []
    for file in files:
        ending = file.suffix.lower()
        if ending in log_endings.SUFFIXES:
            # slow to import, and tables need none of it
            from hil_emulator.captures import capture

            digest = digest_of(file)
            table = capture.read(file, carriers, sync_id, meaning.rated_current)
            experiments_read += experiments_of(recording(file, table, digest))
        elif ending == SUFFIX:
            experiments_read += experiments_of(_journal(file, config))
        elif ending in formats.ENDINGS:
            experiments_read += experiments_of(read(file, meaning.names, meaning.headings))
        else:
            raise UserError(f"{file}: unknown ending; recorded data end in {', '.join(ENDINGS)}")
    return experiments_read


def pairs(options: Sequence[str]) -> dict[str, str]:
    """Return channel by name from options such as `position=CylPos`.

    Raises:
        UserError: for one without "=".

    """
    by_name = {}
    for text in options:
        channel, equals, name = text.partition("=")
        if not equals or not name.strip():
            raise UserError(f"--channel {text}: write CHANNEL=NAME, such as position=CylPos")
        by_name[name.strip()] = channel.strip()
    return by_name


def _carriers(
    files: Sequence[Path], config: Configuration, meaning: Meaning
) -> tuple[list[Carrier], int]:
    """Return the meaning of captured frames, and the identifier of SYNC."""
    if not any(file.suffix.lower() in log_endings.SUFFIXES for file in files):
        return [], 0
    # slow to import, too
    from hil_emulator.captures import by_database, by_dictionary
    from hil_emulator.simulation.node_factory import nodes

    carriers = [c for f in meaning.databases for c in by_database.from_file(f, meaning.names)]
    carriers += by_dictionary.from_files(meaning.sheets, meaning.node_ids)
    made = nodes(config, [channel.name for channel in CHANNELS])
    sync_id = by_dictionary.sync_id(made[0].dictionary) if made else by_dictionary.SYNC
    if not carriers and not made:
        raise UserError(
            f"{config.files[-1]}: no [[node]] says what captured frames mean; name a --dbc or --eds"
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

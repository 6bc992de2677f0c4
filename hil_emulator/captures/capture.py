"""A capture as a table of channels: one row per sample of the device."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from hil_emulator.bus import frame_log
from hil_emulator.bus.frame_log import Captured
from hil_emulator.captures import samples, text_frames
from hil_emulator.captures.carrier import Carrier
from hil_emulator.captures.channels import of_channel
from hil_emulator.captures.traffic import Places, Stream, Traffic, sort
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.identify.measured.channel_names import KNOWN, SET_POINT, TIME
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.measured.formats.table import LogColumn, LogTable

LONGEST = 1_000_000
"""Largest number of samples in a capture; more are an error of its times (assumed: 15 min)."""

_SHOWN = 12  # identifiers named in a message


def read(
    file: Path, carriers: Sequence[Carrier], sync_id: int, channel: str | None = None
) -> LogTable:
    """Read a capture.

    Args:
        file: log of frames in any format, see `log_content`.
        carriers: carriers of the channels.
        sync_id: identifier of SYNC.
        channel: CAN channel to read; None for all, if no identifier comes from two.

    Raises:
        UserError: if the file cannot be read, or holds no known channel.

    """
    kind = frame_log.kind_of(file)
    texts = text_frames.is_one(file, kind)
    frames = text_frames.read(file, kind) if texts else list(frame_log.captured(file))
    result = explained(file, frames, carriers, sync_id, channel)
    if kind != "table":
        return result
    return replace(result, notes=("a table of frames, a row for each", *result.notes))


def explained(
    file: Path, frames: Sequence[Captured], carriers: Sequence[Carrier], sync_id: int,
    channel: str | None = None,
) -> LogTable:  # fmt: skip
    """Turn the frames of a file into a table; see `read`."""
    try:
        return table(of_channel(frames, channel), carriers, sync_id)
    except UserError as error:
        text = str(error)
        raise UserError(text if text.startswith(str(file)) else f"{file}: {text}") from None


def table(
    frames: Iterable[tuple[int, Frame]],
    carriers: Sequence[Carrier],
    sync_id: int,
) -> LogTable:
    """Turn frames with their times [ns] into a table.

    Raises:
        UserError: if there is no known channel, too few of its samples, or its clock drifts.

    """
    traffic = sort(frames, carriers, sync_id)
    chosen = _chosen(traffic)
    readings = {n: c for n, c in chosen.items() if n != SET_POINT}
    if not readings:
        raise UserError(_nothing(traffic, carriers))
    notes = _remarks(traffic)
    reference = max((s for s, _, _ in readings.values()), key=lambda s: len(s.time))
    period = samples.period_of(reference, notes)
    number = samples.numbers_of(reference, period, notes)
    number, sample = samples.without_pauses(number, period)
    rows = len(sample)
    if rows > LONGEST:
        raise UserError(f"{rows} samples; at most {LONGEST} fit one experiment: cut the capture")
    streams = {id(s): s for s, _, _ in readings.values()}
    numbers = {i: samples.joined(s, reference, number, notes) for i, s in streams.items()}
    together = [(streams[i], n) for i, n in numbers.items() if n is not None]
    columns = [LogColumn(TIME, "s", np.asarray(sample * period, np.float64))]
    for name, (stream, key, unit) in readings.items():
        values = _values(stream, key, numbers[id(stream)], reference, number, rows)
        columns.append(LogColumn(name, unit, values))
    commanded = SET_POINT in chosen and id(chosen[SET_POINT][0]) not in streams
    if (
        SET_POINT in chosen and not commanded
    ):  # the device reports its set point with its readings, as a table's row does
        stream, key, unit = chosen[SET_POINT]
        reported = _values(stream, key, numbers[id(stream)], reference, number, rows)
        columns.append(LogColumn(SET_POINT, unit, reported))
    if commanded:
        stream, key, unit = chosen[SET_POINT]
        first = samples.first_places(together, rows)
        time = np.interp(np.arange(rows), number, reference.time)
        current = samples.set_points(stream, key, first, time, traffic.syncs, notes)
        columns.append(LogColumn(SET_POINT, unit, current))
    return LogTable(tuple(columns), set_point_first=commanded or None, notes=tuple(notes))


def _chosen(traffic: Traffic) -> dict[str, tuple[Stream, str, str | None]]:
    """Return for each channel the stream with most frames of it, its key and its unit."""
    best_streams: dict[str, tuple[Stream, str, str | None]] = {}
    for stream in traffic.streams.values():
        for signal in stream.carrier.signals:
            if signal.name not in KNOWN or signal.name == TIME:
                continue
            best = best_streams.get(signal.name)
            if best is None or len(stream.time) > len(best[0].time):
                best_streams[signal.name] = stream, signal.key, signal.unit
    return best_streams


def _values(
    stream: Stream, key: str, sample: Places | None, reference: Stream, number: Places, rows: int
) -> Array:
    """Return a channel's values by sample; NaN for a sample without a frame."""
    values = stream.values[key]
    if sample is None:
        at = np.full(rows, np.nan)
        at[number] = reference.time
        good = np.isfinite(values)
        return np.asarray(np.interp(at, stream.time[good], values[good], np.nan, np.nan))
    out = np.full(rows, np.nan)
    inside = (sample >= 0) & (sample < rows)
    out[sample[inside]] = values[inside]
    return out


def _remarks(traffic: Traffic) -> list[str]:
    notes = [*traffic.remarks]
    if traffic.short:
        notes.append(f"{traffic.short} frames were too short for their PDO, and left out")
    for stream in traffic.streams.values():
        lacking = [
            s.name for s in stream.carrier.signals if not np.isfinite(stream.values[s.key]).any()
        ]
        if lacking:
            notes.append(f"no frame of {stream.carrier.name} holds {', '.join(lacking)}")
    for code, times in sorted(traffic.emergencies.items()):
        if code:
            notes.append(f"emergency {code:04X} was sent {times} times")
    return notes


def _nothing(traffic: Traffic, carriers: Sequence[Carrier]) -> str:
    wanted = ", ".join(
        f"{c.can_id:03X}" for c in carriers if any(s.name in KNOWN for s in c.signals)
    )
    present = sorted(traffic.others | {can_id for can_id, _ in traffic.streams})
    listed = ", ".join(f"{i:03X}" for i in present[:_SHOWN]) or "no frame"
    return (
        f"no frame of a known reading; known are the identifiers {wanted}, in the capture there "
        f"are {listed}; name the files that describe its devices with --dbc or --eds"
    )

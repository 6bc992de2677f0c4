"""The frames of a capture, sorted by carrier."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from hil_emulator.captures.carrier import COUNTER, Carrier
from hil_emulator.captures.parameter_groups import by_parameter_group
from hil_emulator.frame import Frame
from hil_emulator.identify.measured.channel_names import KNOWN
from hil_emulator.identify.measured.experiment import Array

Places = np.ndarray[tuple[int], np.dtype[np.int64]]


@dataclass
class Stream:
    """The frames of one carrier, in the order of the capture.

    Attributes:
        carrier: description of the frames.
        time: time of each frame since the first frame of the capture [s].
        place: index of each frame among all frames.
        values: values by key; NaN if a frame does not hold the signal.

    """

    carrier: Carrier
    time: Array
    place: Places
    values: dict[str, Array]

    @property
    def count(self) -> Array | None:
        """The device's count of samples, unwrapped; None if a frame lacks it."""
        modulus = self.carrier.counter_modulus
        keys = [s.key for s in self.carrier.signals if s.name == COUNTER]
        if not modulus or not keys or not len(self.time):
            return None
        if not np.isfinite(self.values[keys[0]]).all():
            return None
        steps = np.mod(np.diff(self.values[keys[0]]), modulus)
        return np.concatenate([[self.values[keys[0]][0]], self.values[keys[0]][0] + steps.cumsum()])


@dataclass
class Traffic:
    """A capture.

    Attributes:
        streams: streams of the carriers with frames, by identifier and whether it has 29 bits.
        syncs: places of the SYNC frames.
        short: number of frames that were too short for their carrier.
        others: identifiers without a carrier.
        emergencies: number of emergency messages by error code.
        remarks: notes on values and frames that were left out or reassigned.

    """

    streams: dict[tuple[int, bool], Stream]
    syncs: Places
    short: int = 0
    others: set[int] = field(default_factory=set)
    emergencies: dict[int, int] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)


def sort(frames: Iterable[tuple[int, Frame]], carriers: Iterable[Carrier], sync_id: int) -> Traffic:
    """Decode frames.

    Args:
        frames: time [ns] and frame.
        carriers: descriptions of frames; the first of several with one identifier is used.
        sync_id: identifier of SYNC.

    """
    described: dict[tuple[int, bool], Carrier] = {}
    for carrier in carriers:
        described.setdefault((carrier.can_id, carrier.extended), carrier)
    rows: dict[tuple[int, bool], list[tuple[float, ...]]] = {}
    traffic = Traffic({}, np.zeros(0, np.int64))
    frames = sorted(frames, key=lambda item: item[0])
    traffic.remarks += by_parameter_group(described, {f.can_id for _, f in frames if f.extended})
    syncs: list[int] = []
    origin: int | None = None
    # loggers may write frames out of order; a stable sort keeps the order of equal times
    for place, (now_ns, frame) in enumerate(frames):
        origin = now_ns if origin is None else origin
        key = frame.can_id, frame.extended
        carrier_of_frame = described.get(key)
        if frame.remote:
            continue
        if carrier_of_frame is None:
            _other(traffic, frame, syncs, place, sync_id)
        elif len(frame.data) < carrier_of_frame.size:
            traffic.short += 1
        elif carrier_of_frame.signals:
            decoded = carrier_of_frame.decode(frame.data)
            values = (decoded.get(s.key, math.nan) for s in carrier_of_frame.signals)
            rows.setdefault(key, []).append((now_ns - origin, place, *values))
    traffic.syncs = np.array(syncs, np.int64)
    traffic.streams = {key: _stream(described[key], of_key) for key, of_key in rows.items()}
    for stream in traffic.streams.values():
        traffic.remarks += _without_others(stream)
    return traffic


def _without_others(stream: Stream) -> list[str]:
    """Remove values that the database declares not to be readings; return notes on them."""
    notes = []
    for signal in stream.carrier.signals:
        values = stream.values[signal.key]
        low, high = signal.range
        named = np.isin(values, list(signal.names))
        beyond = ((values < low) | (values > high)) & ~named
        if signal.name not in KNOWN or not (named | beyond).any():
            continue
        words = sorted({signal.names[v] for v in np.unique(values[named]).tolist()})
        if words:
            notes.append(f"{signal.name}: {int(named.sum())} values are no readings but "
                        f"{', '.join(repr(word) for word in words)}; left out")  # fmt: skip
        if beyond.any():
            notes.append(
                f"{signal.name}: {int(beyond.sum())} of {len(values)} values are outside the "
                f"{low:.6g} ... {high:.6g} {signal.unit or ''} that its database states; left out"
            )
        values[named | beyond] = np.nan
    return notes


def _other(traffic: Traffic, frame: Frame, syncs: list[int], place: int, sync_id: int) -> None:
    if frame.can_id == sync_id and not frame.extended:
        syncs.append(place)
        return
    traffic.others.add(frame.can_id)
    if frame.can_id & 0x780 == 0x080 and len(frame.data) == 8 and not frame.extended:
        code = int.from_bytes(frame.data[:2], "little")
        traffic.emergencies[code] = traffic.emergencies.get(code, 0) + 1


def _stream(carrier: Carrier, rows: list[tuple[float, ...]]) -> Stream:
    table = np.array(rows, np.float64)
    values = {s.key: table[:, 2 + i].copy() for i, s in enumerate(carrier.signals)}
    return Stream(carrier, table[:, 0] * 1e-9, table[:, 1].astype(np.int64), values)

"""The frames of one CAN channel of a log of several."""

from collections import Counter
from collections.abc import Sequence

from hil_emulator.bus.frame_log import Captured
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame


def of_channel(frames: Sequence[Captured], channel: str | None) -> list[tuple[int, Frame]]:
    """Return time [ns] and frame of the frames of one channel.

    Args:
        frames: frames of all channels.
        channel: name of the channel in the log; None for all channels.

    Raises:
        UserError: if the log has no such channel, or one identifier comes from several.

    """
    if channel is not None:
        chosen = [(f.now_ns, f.frame) for f in frames if f.channel == channel]
        if not chosen:
            raise UserError(f"--bus {channel}: there is no such channel; {_listed(frames)}")
        return chosen
    first: dict[int, str] = {}
    for f in frames:
        if first.setdefault(f.frame.identifier, f.channel) != f.channel:
            raise UserError(
                f"identifier {f.frame.can_id:03X} comes from channel {first[f.frame.identifier]} "
                f"and from channel {f.channel}; {_listed(frames)}; choose one, such as --bus "
                f"{f.channel}"
            )
    return [(f.now_ns, f.frame) for f in frames]


def _listed(frames: Sequence[Captured]) -> str:
    """Return the channels of a log with their traffic."""
    counts = Counter(f.channel for f in frames)
    identifiers = Counter(channel for channel, _ in {(f.channel, f.frame.identifier)
                                                     for f in frames})  # fmt: skip
    return "its channels are " + ", ".join(
        f"{channel or 'unnamed'} ({count} frames, {identifiers[channel]} identifiers)"
        for channel, count in sorted(counts.items())
    )

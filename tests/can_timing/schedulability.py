"""Worst-case response times on CAN, written from the papers: nothing of the emulator is in here."""

from typing import NamedTuple

from hil_emulator.frame import Frame

BIT_NS = 8_000
"""Of 125 kbit/s."""


class Message(NamedTuple):
    """A message stream: the order in a list is that of the priorities.

    Attributes:
        size: bytes of data.
        period_ns: shortest time between two of them.
        jitter_ns: of their queueing.

    """

    size: int
    period_ns: int
    jitter_ns: int = 0


def davis(frame: Frame) -> int:
    """Return the bits of a base frame at worst (Davis et al. 2007, eq. 1)."""
    stuffable = 34 + 8 * len(frame.data)
    return stuffable + 13 + (stuffable - 1) // 4


def tindell(frame: Frame) -> int:
    """Return the bits of a base frame as Tindell and Burns 1994 take them."""
    stuffable = 34 + 8 * len(frame.data)
    return stuffable + 13 + stuffable // 5


def response_times(
    transmission_ns: list[int], messages: list[Message], blocking_ns: int | None = None
) -> list[int]:
    """Return the worst-case response time of each message (Davis et al. 2007, 3.2).

    Args:
        transmission_ns: of each message, with the intermission.
        messages: by falling priority.
        blocking_ns: of a frame that has just begun; the longest of lower priority without.

    """
    responses = []
    for m, (own_ns, message) in enumerate(zip(transmission_ns, messages, strict=True)):
        lower = max(transmission_ns[m + 1 :], default=0)
        blocked_ns = lower if blocking_ns is None else blocking_ns
        higher = list(zip(transmission_ns[:m], messages[:m], strict=True))
        # the busy period of this priority, and how many instances it has (eq. 6 and 7)
        busy = own_ns
        while True:
            longer = blocked_ns + sum(
                -(-(busy + k.jitter_ns) // k.period_ns) * c for c, k in [*higher, (own_ns, message)]
            )
            if longer == busy:
                break
            busy = longer
        instances = -(-(busy + message.jitter_ns) // message.period_ns)
        worst = 0
        for q in range(instances):
            waited = blocked_ns + q * own_ns
            while True:
                longer = (
                    blocked_ns
                    + q * own_ns
                    + sum(-(-(waited + k.jitter_ns + BIT_NS) // k.period_ns) * c for c, k in higher)
                )
                if longer == waited:
                    break
                waited = longer
            worst = max(worst, message.jitter_ns + waited - q * message.period_ns + own_ns)
        responses.append(worst)
    return responses

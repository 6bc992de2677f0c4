"""Errors that end a run whose plant has failed: a state that is not finite, or a failed FMU."""

from hil_emulator.errors import UserError


class NotFiniteError(UserError):
    """A state of the model has become infinite or NaN: the run has ended.

    Args:
        now_ns: time of the tick in which it was detected [ns].
        state: its name; the first of several.

    """

    exit_code = 1

    def __init__(self, now_ns: int, state: str) -> None:
        super().__init__(
            f"at {now_ns * 1e-9:.3f} s the model's {state} is not finite any more; `check` "
            "reports an integration step that is too long; an effect of your own may be the reason"
        )


class PlantFailedError(UserError):
    """The plant that replaces the built-in one has failed; the nodes have stayed on the bus."""

    exit_code = 1

"""A picture that shows itself in a notebook."""

from dataclasses import dataclass
from pathlib import Path

from hil_emulator.errors import UserError


@dataclass(frozen=True)
class Picture:
    """A drawn picture.

    Attributes:
        png: its content as PNG.

    """

    png: bytes

    def save(self, file: str | Path) -> None:
        """Write it.

        Raises:
            UserError: if it cannot be written.

        """
        try:
            Path(file).write_bytes(self.png)
        except OSError as error:
            raise UserError(f"{file}: cannot be written: {error.strerror}") from None

    def _repr_png_(self) -> bytes:
        return self.png

    def __repr__(self) -> str:
        return f"Picture({len(self.png)} bytes of PNG)"

"""A picture that shows itself in a notebook."""

from dataclasses import dataclass
from pathlib import Path

from hil_emulator.platform.output_files import FROM_PYTHON, new_files, refuse_existing


@dataclass(frozen=True)
class Picture:
    """A drawn picture.

    Attributes:
        png: its content as PNG.

    """

    png: bytes

    def save(self, file: str | Path, *, overwrite: bool = False) -> None:
        """Write it.

        Args:
            file: the picture's file.
            overwrite: whether an existing file is replaced.

        Raises:
            UserError: if it exists or cannot be written.

        """
        refuse_existing([Path(file)], overwrite=overwrite, way_out=FROM_PYTHON)
        with new_files(overwrite=overwrite) as staged:
            staged(Path(file)).write_bytes(self.png)

    def _repr_png_(self) -> bytes:
        return self.png

    def __repr__(self) -> str:
        return f"Picture({len(self.png)} bytes of PNG)"

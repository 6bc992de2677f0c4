"""The process that writes a recording: a journal at once, other formats at the end.

It outlives the emulator: when the pipe ends, it still writes the files. The libraries of formats
are imported only then, so that it starts quickly. On its standard output it writes an empty line
once the journal holds the first block, then a line for each failure.
"""

import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

from hil_emulator.errors import UserError
from hil_emulator.platform.helper_process import report
from hil_emulator.recording import journal, journal_of

OVERWRITE = "--overwrite"
"""First argument if the files may replace existing ones."""

_CHUNK = 1 << 20


def write(stream: BinaryIO, files: list[Path], *, overwrite: bool = False) -> bool:
    """Write a stream of entries into files; return whether all is written.

    The journal (`journal_of`) is removed at the end unless it is one of the files. A run without a
    tick leaves no file.

    Raises:
        UserError: if the disk is full before the first block.
        OSError: if the journal cannot be created; an existing one is not changed.

    """
    source = journal_of(files)
    whole = _journal(stream, source)
    begun = journal.has_begun(source)
    if begun:
        whole &= _export(source, [file for file in files if file != source], overwrite=overwrite)
    if not begun or (whole and source not in files):
        source.unlink()
    return whole


def _journal(stream: BinaryIO, source: Path) -> bool:
    """Append the stream to the journal; return whether it is complete."""
    whole = True
    with source.open("xb", buffering=0) as out:
        _begin(out, _chunk(stream), source)
        while chunk := _chunk(stream):
            try:
                if whole:
                    _put(out, chunk)
            except (
                OSError
            ) as error:  # a full disk: continue to read, so that the loop is not blocked
                whole = False
                report(
                    f"recording {source} ends early: {error.strerror}; recording has stopped, "
                    "the data until then can be read; make room and start another recording"
                )
    return whole


def _begin(out: BinaryIO, chunk: bytes, source: Path) -> None:
    """Write the first block; on a full disk the file is removed."""
    try:
        _put(out, chunk)
    except OSError as error:
        source.unlink()
        raise UserError(f"{source}: cannot be written: {error.strerror}; make room") from None
    report("")


def _chunk(stream: BinaryIO) -> bytes:
    """Return the arrived bytes; b"" at the end."""
    return stream.read1(_CHUNK)  # type: ignore[attr-defined, no-any-return]


def _put(out: BinaryIO, chunk: bytes) -> None:
    while chunk:
        chunk = chunk[out.write(chunk) :]


def _export(source: Path, files: Sequence[Path], *, overwrite: bool) -> bool:
    """Write the journal in all other formats or in no format; return whether they are written."""
    from hil_emulator.recording.exports import export

    try:
        export(source, *files, overwrite=overwrite)
    except UserError as error:
        names = " ".join(map(str, files))
        report(f"recording {error}; correct that, then: hil-emulator convert {source} {names}")
        return False
    return True


def main() -> int:
    """Write standard input to the files of the arguments, the first of which can be `OVERWRITE`."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    overwrite = sys.argv[1] == OVERWRITE
    files = [Path(name) for name in sys.argv[1 + overwrite :]]
    try:
        return 0 if write(sys.stdin.buffer, files, overwrite=overwrite) else 1
    except UserError as error:
        report(str(error))
    except OSError as error:
        report(f"{error.filename}: cannot be written: {error.strerror}")
    return 1


if __name__ == "__main__":
    sys.exit(main())

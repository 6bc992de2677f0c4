"""The process beside the loop: from a pipe to a journal at once, to other formats at the end.

It outlives the emulator: when the pipe ends, for whatever reason, it still writes the files. What
those formats need is imported only then, so that it is ready soon. On its standard output it writes
an empty line once the journal holds the first block, then a line for each failure.
"""

import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

from hil_emulator.errors import UserError
from hil_emulator.platform.helper_process import report
from hil_emulator.recording import SUFFIX

_CHUNK = 1 << 20


def journal_file(files: Sequence[Path]) -> Path:
    """Return the journal: the first file that is one, or one beside the first file."""
    kept = next((f for f in files if f.suffix == SUFFIX), None)
    return kept or files[0].with_name(files[0].name + SUFFIX)


def write(stream: BinaryIO, files: list[Path]) -> bool:
    """Write a stream of entries into files; return whether all is written.

    A journal that is not one of the files is removed when they are written.

    Raises:
        UserError: if the journal has no room for the first block.
        OSError: if it cannot be created.

    """
    source = journal_file(files)
    whole = _journal(stream, source)
    whole &= _export(source, [file for file in files if file != source])
    if whole and source not in files:
        source.unlink()
    return whole


def _journal(stream: BinaryIO, source: Path) -> bool:
    """Append the stream to the journal; return whether all of it is there."""
    whole = True
    with source.open("wb", buffering=0) as out:
        _begin(out, _chunk(stream), source)
        while chunk := _chunk(stream):
            try:
                if whole:
                    _put(out, chunk)
            except OSError as error:  # a full disk: go on reading, the loop must not notice
                whole = False
                report(
                    f"recording {source} ends early: {error.strerror}; nothing more is recorded, "
                    "what was written before can be read; make room and start another recording"
                )
    return whole


def _begin(out: BinaryIO, chunk: bytes, source: Path) -> None:
    """Write the first block; a file that has no room for it is removed."""
    try:
        _put(out, chunk)
    except OSError as error:
        source.unlink()
        raise UserError(f"{source}: cannot be written: {error.strerror}; make room") from None
    report("")


def _chunk(stream: BinaryIO) -> bytes:
    """Return what has come, at the end nothing."""
    return stream.read1(_CHUNK)  # type: ignore[attr-defined, no-any-return]


def _put(out: BinaryIO, chunk: bytes) -> None:
    while chunk:
        chunk = chunk[out.write(chunk) :]


def _export(source: Path, files: Sequence[Path]) -> bool:
    """Write the journal in other formats; return whether all are written."""
    from hil_emulator.recording.exports import export

    whole = True
    for file in files:
        try:
            export(source, file)
        except UserError as error:
            whole = False
            report(f"recording {error}; mend that, then: hil-emulator convert {source} {file}")
    return whole


def main() -> int:
    """Write standard input to the files named as arguments."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        return 0 if write(sys.stdin.buffer, [Path(name) for name in sys.argv[1:]]) else 1
    except UserError as error:
        report(str(error))
    except OSError as error:
        report(f"{error.filename}: cannot be written: {error.strerror}")
    return 1


if __name__ == "__main__":
    sys.exit(main())

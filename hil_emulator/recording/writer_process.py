"""The process beside the loop: from a pipe to a journal at once, to other formats at the end.

It outlives the emulator: when the pipe ends, for whatever reason, it still writes the files. What
those formats need is imported only then, so that it is ready soon.
"""

import signal
import sys
from pathlib import Path
from typing import BinaryIO

from hil_emulator.errors import UserError
from hil_emulator.recording import journal_of

READY = b"\n"
"""Said on standard output once the journal is open."""

OVERWRITE = "--overwrite"
"""First argument where the files may replace existing ones."""

_CHUNK = 1 << 20


def write(stream: BinaryIO, files: list[Path], ready: BinaryIO, *, overwrite: bool = False) -> None:
    """Write a stream of entries into files; an empty stream leaves no file.

    The journal (`journal_of`) is removed at the end unless it is one of the files.

    Raises:
        UserError: if a file could not be written to its end; the journal stays.
        OSError: if the journal cannot be made; one that exists is left alone.

    """
    source = journal_of(files)
    trouble = _journal(stream, source, ready)
    if trouble:
        raise UserError(f"{source} ends early: {trouble}; no other file was written")
    empty = not source.stat().st_size
    if not empty:
        _export(source, [file for file in files if file != source], overwrite=overwrite)
    if empty or source not in files:
        source.unlink()


def _journal(stream: BinaryIO, source: Path, ready: BinaryIO) -> str:
    """Write the stream into the journal; return what ended that early, or ""."""
    trouble = ""
    with source.open("xb", buffering=0) as out:
        ready.write(READY)
        ready.close()
        while chunk := stream.read1(_CHUNK):  # type: ignore[attr-defined]
            try:
                while chunk and not trouble:
                    chunk = chunk[out.write(chunk) :]
            except OSError as error:  # a full disk: go on reading, the loop must not notice
                trouble = error.strerror or str(error)
    return trouble


def _export(source: Path, files: list[Path], *, overwrite: bool) -> None:
    from hil_emulator.recording.exports import export

    export(source, *files, overwrite=overwrite)


def main() -> int:
    """Write standard input to the files named as arguments, `OVERWRITE` first where it is so."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    overwrite = sys.argv[1] == OVERWRITE
    files = [Path(name) for name in sys.argv[1 + overwrite :]]
    try:
        write(sys.stdin.buffer, files, sys.stdout.buffer, overwrite=overwrite)
    except UserError as error:
        print(error, file=sys.stderr)
        return 1
    except OSError as error:
        print(f"{error.filename}: cannot be written: {error.strerror}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

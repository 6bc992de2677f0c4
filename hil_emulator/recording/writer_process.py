"""The process beside the loop: from a pipe to a journal at once, to other formats at the end.

It outlives the emulator: when the pipe ends, for whatever reason, it still writes the files. What
those formats need is imported only then, so that it is ready soon.
"""

import signal
import sys
from pathlib import Path
from typing import BinaryIO

from hil_emulator.errors import UserError
from hil_emulator.recording import SUFFIX

READY = b"\n"
"""Said on standard output once the journal is open."""

_CHUNK = 1 << 20


def write(stream: BinaryIO, files: list[Path], ready: BinaryIO) -> None:
    """Write a stream of entries into files.

    The journal stands beside the first file and is removed when all files are written.

    Raises:
        UserError: if a file could not be written to its end; the journal stays.

    """
    kept = next((f for f in files if f.suffix == SUFFIX), None)
    source = kept or files[0].with_name(files[0].name + SUFFIX)
    trouble = _journal(stream, source, ready)
    _export(source, [file for file in files if file != source])
    if trouble:
        raise UserError(f"{source} ends early: {trouble}")
    if kept is None:
        source.unlink()


def _journal(stream: BinaryIO, source: Path, ready: BinaryIO) -> str:
    """Append the stream to the journal; return what ended that early, or ""."""
    trouble = ""
    with source.open("wb", buffering=0) as out:
        ready.write(READY)
        ready.close()
        while chunk := stream.read1(_CHUNK):  # type: ignore[attr-defined]
            try:
                while chunk and not trouble:
                    chunk = chunk[out.write(chunk) :]
            except OSError as error:  # a full disk: go on reading, the loop must not notice
                trouble = error.strerror or str(error)
    return trouble


def _export(source: Path, files: list[Path]) -> None:
    from hil_emulator.recording.exports import export

    for file in files:
        export(source, file)


def main() -> int:
    """Write standard input to the files named as arguments."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        write(sys.stdin.buffer, [Path(name) for name in sys.argv[1:]], sys.stdout.buffer)
    except UserError as error:
        print(error, file=sys.stderr)
        return 1
    except OSError as error:
        print(f"{error.filename}: cannot be written: {error.strerror}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

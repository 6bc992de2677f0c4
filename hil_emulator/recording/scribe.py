"""The process beside the loop: from a pipe to a journal at once, to other formats at the end.

It outlives the emulator: when the pipe ends, for whatever reason, it still writes the files.
"""

import os
import signal
import sys
from pathlib import Path
from typing import BinaryIO

from hil_emulator.errors import UserError
from hil_emulator.recording.exports import export
from hil_emulator.recording.journal import SUFFIX

_CHUNK = 1 << 20


def write(stream: BinaryIO, files: list[Path]) -> None:
    """Write a stream of entries into files.

    The journal stands beside the first file and is removed when all files are written.

    Raises:
        UserError: if a file could not be written to its end; the journal stays.

    """
    kept = next((f for f in files if f.suffix == SUFFIX), None)
    source = kept or files[0].with_name(files[0].name + SUFFIX)
    trouble = _journal(stream, source)
    for file in files:
        if file != source:
            export(source, file)
    if trouble:
        raise UserError(f"{source} ends early: {trouble}")
    if kept is None:
        source.unlink()


def _journal(stream: BinaryIO, source: Path) -> str:
    """Append the stream to the journal; return what ended that early, or ""."""
    trouble = ""
    with source.open("wb", buffering=0) as out:
        while chunk := stream.read1(_CHUNK):  # type: ignore[attr-defined]
            try:
                while chunk and not trouble:
                    chunk = chunk[out.write(chunk) :]
            except OSError as error:  # a full disk: go on reading, the loop must not notice
                trouble = error.strerror or str(error)
    return trouble


def main() -> int:
    """Write standard input to the files named as arguments."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(5)  # the loop goes first (assumed)
    try:
        write(sys.stdin.buffer, [Path(name) for name in sys.argv[1:]])
    except UserError as error:
        print(error, file=sys.stderr)
        return 1
    except OSError as error:
        print(f"{error.filename}: cannot be written: {error.strerror}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

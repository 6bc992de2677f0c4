"""A ring of bytes in shared memory: one process writes and never waits, another one reads.

The loop writes whole entries and then tells how far it has come, in one store of eight bytes. A
reader copies first and looks afterwards whether what it copied had been overwritten meanwhile; then
it goes on at the newest entry and says how much it has missed. There is no lock, and nothing that a
reader does reaches the writer. The memory is a file without a name: only a process that inherits
its descriptor can see it, and it is gone with the last of them.
"""

import mmap
import os
import tempfile
from pathlib import Path

_HEADER = 64
"""Bytes before the data: how many have been written in all, and when [ns]."""
_SHARED_MEMORY = Path("/dev/shm")  # where Linux keeps files that are memory

SIZE = 1 << 25
"""Bytes of the ring: half a minute of the reference machine at 1 kHz (assumed)."""
LARGEST = 1 << 20
"""Most bytes written at once; a reader keeps as far behind the place that is being written."""


class RingWriter:
    """The writing end, which makes the memory.

    Args:
        size: bytes of data, a power of two.

    Attributes:
        fd: the descriptor that a reader inherits.

    """

    def __init__(self, size: int = SIZE) -> None:
        folder = str(_SHARED_MEMORY) if _SHARED_MEMORY.is_dir() else None
        self._file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115 - closed by close()
        self._file.truncate(_HEADER + size)
        self.fd = self._file.fileno()
        self._memory = mmap.mmap(self.fd, _HEADER + size)
        self._words = memoryview(self._memory)[:_HEADER].cast("Q")
        self._data = memoryview(self._memory)[_HEADER:]
        self._size = size
        self._written = 0

    def write(self, entries: bytes | bytearray, now_ns: int) -> None:
        """Append whole entries, `LARGEST` bytes at most; more is left out.

        Args:
            entries: the bytes.
            now_ns: the monotonic clock [ns].

        """
        count = len(entries)
        if count > LARGEST:
            return
        at = self._written & (self._size - 1)
        first = min(count, self._size - at)
        self._data[at : at + first] = entries[:first]
        if first < count:
            self._data[: count - first] = entries[first:]
        self._written += count
        self._words[1] = now_ns
        self._words[0] = self._written

    def close(self) -> None:
        """Leave the memory to its readers."""
        self._words.release()
        self._data.release()
        self._memory.close()
        self._file.close()


class RingReader:
    """The reading end.

    Args:
        fd: an inherited descriptor of the memory.

    Attributes:
        missed: bytes that were overwritten before they were read.
        stamp_ns: when what was read last had been written, by the monotonic clock [ns].

    """

    def __init__(self, fd: int) -> None:
        self._memory = mmap.mmap(fd, os.fstat(fd).st_size, prot=mmap.PROT_READ)
        self._words = memoryview(self._memory)[:_HEADER].cast("Q")
        self._size = len(self._memory) - _HEADER
        self._read = 0
        self.missed = 0
        self.stamp_ns = 0

    def read(self) -> bytes:
        """Return all whole entries since the last call; after a loss, only what comes from now."""
        self.stamp_ns = self._words[1]
        written = self._words[0]
        count = written - self._read
        if count == 0:
            return b""
        at = _HEADER + (self._read & (self._size - 1))
        end = min(at + count, _HEADER + self._size)
        found = self._memory[at:end]
        if len(found) < count:
            found += self._memory[_HEADER : _HEADER + count - len(found)]
        begin, self._read = self._read, written
        if (
            self._words[0] + LARGEST - begin > self._size
        ):  # overwritten while, or before, it was read
            self.missed += count
            return b""
        return found

    def close(self) -> None:
        """Let go of the memory."""
        self._words.release()
        self._memory.close()

"""A ring buffer in shared memory: one process writes without waiting, another one reads.

The loop writes complete entries and then publishes its position by one store of eight bytes. A
reader copies first and then checks whether its copy was overwritten meanwhile. In that case it
continues at the newest entry and counts the loss. There is no lock, and a reader cannot affect the
writer. The memory is a file without a name: only a process that inherits its descriptor can access
it, and it disappears with the last of them.
"""

import mmap
import os
import tempfile
from pathlib import Path

_HEADER = 64
"""Bytes before the data: number of bytes written in all, and the time of the last write [ns]."""
_SHARED_MEMORY = Path("/dev/shm")  # folder of files in memory on Linux

SIZE = 1 << 25
"""Bytes of the ring: half a minute of the reference machine at 1 kHz (assumed)."""
LARGEST = 1 << 20
"""Largest number of bytes written at once, and distance that a reader keeps from the writer."""


class RingWriter:
    """The writing end, which creates the memory.

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
        """Append complete entries, `LARGEST` bytes at most; more is left out.

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
        """Close the descriptor; readers keep the memory."""
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
        stamp_ns: when the last read data were written, by the monotonic clock [ns].

    """

    def __init__(self, fd: int) -> None:
        self._memory = mmap.mmap(fd, os.fstat(fd).st_size, prot=mmap.PROT_READ)
        self._words = memoryview(self._memory)[:_HEADER].cast("Q")
        self._size = len(self._memory) - _HEADER
        self._read = 0
        self.missed = 0
        self.stamp_ns = 0

    def read(self) -> bytes:
        """Return all complete entries since the last call; after a loss, only those from now on."""
        self.stamp_ns = self._words[1]
        written = self._words[0]
        count = written - self._read
        if count == 0:
            return b""
        at = _HEADER + (self._read & (self._size - 1))
        end = min(at + count, _HEADER + self._size)
        data = self._memory[at:end]
        if len(data) < count:
            data += self._memory[_HEADER : _HEADER + count - len(data)]
        begin, self._read = self._read, written
        if (
            self._words[0] + LARGEST - begin > self._size
        ):  # overwritten while, or before, it was read
            self.missed += count
            return b""
        return data

    def close(self) -> None:
        """Release the memory."""
        self._words.release()
        self._memory.close()

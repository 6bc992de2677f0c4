"""Arrays of numpy's archives, each as large as its bytes in the file."""

import math
import zipfile
from pathlib import Path
from typing import IO, Any

import numpy as np

from hil_emulator import input_files
from hil_emulator.input_files import Limit

_ENDING = ".npy"
_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


def read(file: Path, limit: Limit) -> dict[str, np.ndarray[Any, Any]]:
    """Return all arrays of an archive by name.

    numpy reserves the memory that an array's header states; here that must be the size of its data.

    Raises:
        UserError: if the file is too large, or unpacks to more than `input_files` allows.
        OSError, ValueError, zipfile.BadZipFile: if it is damaged.

    """
    input_files.check_archive(file, limit)
    arrays = {}
    with zipfile.ZipFile(file) as archive:
        for member in archive.infolist():
            if not member.filename.endswith(_ENDING):
                continue
            with archive.open(member) as stream:
                _check_header(stream, member)
                stream.seek(0)
                array = np.lib.format.read_array(stream, allow_pickle=False)
            arrays[member.filename.removesuffix(_ENDING)] = array
    return arrays


def _check_header(stream: IO[bytes], member: zipfile.ZipInfo) -> None:
    version = np.lib.format.read_magic(stream)
    if version not in _HEADERS:
        raise ValueError(f"{member.filename} is of version {version[0]}.{version[1]}")
    shape, _, dtype = _HEADERS[version](stream)
    count, left = math.prod(shape), member.file_size - stream.tell()
    if (
        dtype.hasobject
        or min(shape, default=0) < 0
        or count * dtype.itemsize != left
        or (count > left)
    ):
        raise ValueError(
            f"{member.filename} states {shape} values of {dtype}, and has {left} bytes"
        )

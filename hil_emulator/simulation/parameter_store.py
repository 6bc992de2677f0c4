"""Stored parameters on disk: one file per node, used completely or not at all.

The file is JSON: its writer, the device, the values by object, and a checksum over them. It is
written next to the old one and moved over it, so a crash leaves either the old or the new values. A
damaged file, or one of another device, is neither used nor changed. The node starts with its
defaults, and the next save renames that file with the ending `.refused`.
"""

import hashlib
import json
import os
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hil_emulator import input_files
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.storage import Values
from hil_emulator.errors import UserError

FORMAT = "hil-emulator parameters 1"
IDENTITY, VENDOR_PRODUCT_REVISION = 0x1018, (1, 2, 3)


class ParameterFile:
    """Keeps a node's stored parameters in a file (a `hil_emulator.device.storage.Storage`).

    Args:
        path: the file; it need not exist, and its folder is created.
        dictionary: the node's dictionary, which identifies the device.
        report: called with a message if a file is refused.

    Raises:
        UserError: the folder cannot be made, or the file cannot be read.

    """

    def __init__(self, path: Path, dictionary: Dictionary, report: Callable[[str], None]) -> None:
        self._path = path
        self._device = fingerprint(dictionary)
        self._values: Values = {}
        self._is_refused = False
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            there = path.exists()
            text = input_files.read_text(path, input_files.PARAMETERS) if there else ""
        except UnicodeDecodeError:
            text = "no text"
        except OSError as error:
            raise UserError(
                f"{path}: stored parameters cannot be read: {error.strerror}; "
                "correct its rights, or choose another storage folder"
            ) from None
        if text:
            try:
                self._values = _values(input_files.parse_json(text), self._device)
            except (ValueError, KeyError, TypeError, AttributeError) as error:
                self._is_refused = True
                reason = error if isinstance(error, _RefusedError) else "it is damaged"
                report(
                    f"{path}: not used, {reason}; node {dictionary.node_id} starts with defaults"
                )
        elif path.exists():
            report(f"{path}: not used, it is empty; node {dictionary.node_id} starts with defaults")

    def load(self) -> Values:
        """Return the last saved values, empty at first."""
        return self._values

    def save(self, values: Values) -> None:
        """Replace the stored values.

        Raises:
            OSError: the file cannot be written; the old one is kept.

        """
        written = {f"{i:04X}:{s:02X}": data.hex() for (i, s), data in sorted(values.items())}
        content = {
            "format": FORMAT,
            "device": self._device,
            "checksum": _checksum(written),
            "values": written,
        }
        new = self._path.with_name(f"{self._path.name}.{secrets.token_hex(4)}.new")
        try:
            with new.open("x", encoding="utf-8") as out:
                json.dump(content, out, indent=1)
                out.flush()
                os.fsync(out.fileno())
            if self._is_refused:
                self._path.rename(self._path.with_name(f"{new.stem}.refused"))
                self._is_refused = False
            new.replace(self._path)
        except OSError:
            new.unlink(missing_ok=True)
            raise
        self._values = dict(values)


class _RefusedError(ValueError):
    """A complete file that cannot be used."""


def fingerprint(dictionary: Dictionary) -> str:
    """Return a fingerprint of a device's parameters: identity and every object.

    It does not depend on the serial number. It changes with the objects of the EDS, their data
    types and limits.
    """
    parts = [dictionary.get(IDENTITY, n) for n in VENDOR_PRODUCT_REVISION]
    identity = [0 if part is None else part.default for part in parts]
    objects = sorted(
        (e.index, e.subindex, e.type.name, e.access, str(e.low), str(e.high)) for e in dictionary
    )
    return hashlib.sha256(json.dumps([identity, objects]).encode()).hexdigest()[:16]


def _values(content: Any, device: str) -> Values:
    if content["format"] != FORMAT:
        raise _RefusedError("it has another format")
    if content["checksum"] != _checksum(content["values"]):
        raise _RefusedError("its checksum is wrong")
    if content["device"] != device:
        raise _RefusedError("it belongs to another device or to an older EDS")
    return {
        (int(key[:4], 16), int(key[5:], 16)): bytes.fromhex(data)
        for key, data in content["values"].items()
    }


def _checksum(values: dict[str, str]) -> str:
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()

"""Counters and checksums of messages, by the names that data sheets give them.

`sae_j1850` puts the CRC-8/SAE-J1850 of all other bytes, in their order, into a signal of one byte;
a counter is a signal of the DBC. `autosar_e2e_p01` and `autosar_e2e_p02` put the CRC of AUTOSAR
E2E profile 1 (data ID in both bytes) or profile 2 into byte 0, and a counter into the low bits of
byte 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from hil_emulator.errors import UserError

SAE_J1850, PROFILE_1, PROFILE_2 = "sae_j1850", "autosar_e2e_p01", "autosar_e2e_p02"
LIST_LENGTH = 16
"""Data IDs of AUTOSAR E2E profile 2, one for each counter."""
_COUNTER = 0x0F
_EXTRA = 'pip install "hil-emulator[partners]"'


@dataclass(frozen=True)
class Protection:
    """How a message is protected.

    Attributes:
        checksum: one of the names above.
        place: byte of a `sae_j1850` checksum.
        data_id: of profile 1.
        data_ids: of profile 2.

    Raises:
        UserError: the library that computes it is not installed.

    """

    checksum: str
    place: int = 0
    data_id: int = 0
    data_ids: Sequence[int] = ()

    def __post_init__(self) -> None:
        library = "crccheck" if self.checksum == SAE_J1850 else "e2e"
        try:
            __import__(library)
        except ImportError:
            raise UserError(f"checksum {self.checksum} needs {_EXTRA}") from None

    @property
    def counts(self) -> bool:
        """Whether the header contains a counter."""
        return self.checksum != SAE_J1850

    def protect(self, data: bytes, last: int) -> tuple[bytes, int]:
        """Return data with counter and checksum.

        Args:
            data: as packed.
            last: counter of the message before.

        Returns:
            The data, and their counter.

        """
        made = bytearray(data)
        if not self.counts:
            made[self.place] = self._crc(data)
            return bytes(made), last
        from e2e import p01, p02

        made[1] = made[1] & ~_COUNTER | last & _COUNTER
        if self.checksum == PROFILE_1:
            p01.e2e_p01_protect(made, self.data_id)
        else:
            p02.e2e_p02_protect(made, bytes(self.data_ids))
        return bytes(made), made[1] & _COUNTER

    def accepts(self, data: bytes) -> bool:
        """Return whether the checksum of received data is right."""
        if not self.counts:
            return data[self.place] == self._crc(data)
        from e2e import p01, p02

        if self.checksum == PROFILE_1:
            return bool(p01.e2e_p01_check(bytearray(data), self.data_id))
        return bool(p02.e2e_p02_check(bytearray(data), bytes(self.data_ids)))

    def _crc(self, data: bytes) -> int:
        from crccheck.crc import Crc8SaeJ1850

        return int(Crc8SaeJ1850.calc(data[: self.place] + data[self.place + 1 :]))

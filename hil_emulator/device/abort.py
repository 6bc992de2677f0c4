"""SDO abort codes (CiA 301 7.2.4.3.17) and the exception that carries one to the client."""

from enum import IntEnum


class AbortCode(IntEnum):
    """Why an SDO transfer ended without its data being moved."""

    TOGGLE_BIT_NOT_ALTERNATED = 0x0503_0000
    TIMED_OUT = 0x0504_0000
    UNKNOWN_COMMAND = 0x0504_0001
    INVALID_BLOCK_SIZE = 0x0504_0002
    INVALID_SEQUENCE_NUMBER = 0x0504_0003
    CRC_ERROR = 0x0504_0004
    OUT_OF_MEMORY = 0x0504_0005
    UNSUPPORTED_ACCESS = 0x0601_0000
    WRITE_ONLY = 0x0601_0001
    READ_ONLY = 0x0601_0002
    NO_SUCH_OBJECT = 0x0602_0000
    NOT_MAPPABLE = 0x0604_0041
    PDO_LENGTH_EXCEEDED = 0x0604_0042
    PARAMETER_INCOMPATIBLE = 0x0604_0043
    HARDWARE_ERROR = 0x0606_0000
    LENGTH_MISMATCH = 0x0607_0010
    LENGTH_TOO_HIGH = 0x0607_0012
    LENGTH_TOO_LOW = 0x0607_0013
    NO_SUCH_SUBINDEX = 0x0609_0011
    INVALID_VALUE = 0x0609_0030
    VALUE_TOO_HIGH = 0x0609_0031
    VALUE_TOO_LOW = 0x0609_0032
    GENERAL_ERROR = 0x0800_0000
    CANNOT_BE_STORED = 0x0800_0020
    WRONG_DEVICE_STATE = 0x0800_0022
    NO_DATA = 0x0800_0024


class SdoAbort(Exception):  # noqa: N818 - CiA 301 calls it an abort, not an error
    """An access to the dictionary that CiA 301 answers with an abort code."""

    def __init__(self, code: AbortCode) -> None:
        super().__init__(f"{code.name.lower().replace('_', ' ')} (0x{code:08X})")
        self.code = code

"""Emergency error codes in words (CiA 301 7.2.7.1)."""

from hil_emulator.device.emergency import ErrorCode

_CLASSES = {
    0x0000: "no error", 0x1000: "generic error", 0x2000: "current",
    0x2100: "current, input side", 0x2200: "current inside the device",
    0x2300: "current, output side", 0x3000: "voltage", 0x3100: "mains voltage",
    0x3200: "voltage inside the device", 0x3300: "output voltage", 0x4000: "temperature",
    0x4100: "ambient temperature", 0x4200: "device temperature", 0x5000: "hardware",
    0x6000: "software", 0x6100: "internal software", 0x6200: "user software", 0x6300: "data set",
    0x7000: "additional modules", 0x8000: "monitoring", 0x8100: "communication",
    0x8200: "protocol", 0x9000: "external error", 0xF000: "additional functions",
    0xFF00: "device-specific",
}  # fmt: skip
"""Table 26 of CiA 301: by the upper byte, or the upper digit, of the code."""

_KNOWN = {code: code.name.lower().replace("_", " ") for code in ErrorCode if code}


def emergency(data: bytes) -> str:
    """Return an EMCY message in words: code, its meaning, the error register."""
    code = int.from_bytes(data[:2], "little")
    if code == 0:
        return "no error any more"
    group = _CLASSES.get(code & 0xFF00) or _CLASSES.get(code & 0xF000, "unknown")
    sensor = code & 0xFFF0 == ErrorCode.SENSOR_OVERRANGE
    word = (
        "sensor out of range"
        if sensor
        else _KNOWN.get(ErrorCode(code), group)
        if code in _KNOWN
        else group
    )
    return f"0x{code:04X} {word}, register 0x{data[2]:02X}"

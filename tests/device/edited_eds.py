"""Variants of the shipped EDS."""

from pathlib import Path

from device_master import EDS


def edited(tmp_path: Path, *replacements: tuple[str, str]) -> Path:
    """Return a copy of the shipped EDS with some text replaced."""
    text = EDS.read_text()
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "edited.eds"
    path.write_text(text)
    return path


def added(section: str, data_type: int, *lines: str, access: str = "rw") -> tuple[str, str]:
    """Return a replacement that adds an object to the shipped EDS."""
    head = f"[{section}]\nParameterName=added\nDataType=0x{data_type:X}\nAccessType={access}\n"
    return ("[2000]\n", head + "\n".join(lines) + "\n\n[2000]\n")

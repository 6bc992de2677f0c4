"""An EDS of a device that has every service, so that every case applies to it."""

from pathlib import Path

from hil_emulator.platform.paths import shipped

_OBJECT = """[{index:04X}]
ParameterName={name}
ObjectType=0x7
DataType=0x{data_type:04X}
AccessType={access}
{rest}

"""
_OBJECTS = (
    # index, name, data type, access, other keys
    (0x2100, "loop_8", 0x05, "rw", "PDOMapping=1\nDefaultValue=7\nLowLimit=3\nHighLimit=200"),
    (0x2101, "loop_16", 0x03, "rw", "PDOMapping=1\nDefaultValue=-2"),
    (0x2102, "loop_32", 0x07, "rw", "PDOMapping=1\nDefaultValue=0x11223344"),
    (0x2103, "loop_real", 0x08, "rw", "PDOMapping=1\nDefaultValue=1.5"),
    (0x2110, "text", 0x09, "rw", "PDOMapping=0\nDefaultValue=to be written"),
    (0x2111, "program", 0x0F, "rw", "PDOMapping=0"),
    (0x2112, "command", 0x05, "wo", "PDOMapping=0\nDefaultValue=0"),
    (0x2113, "limited", 0x03, "rw", "PDOMapping=0\nDefaultValue=5\nLowLimit=-10\nHighLimit=10"),
    (0x2114, "input", 0x06, "rwr", "PDOMapping=1\nDefaultValue=0x1234"),
)  # fmt: skip


def every_service(folder: Path) -> Path:
    """Write the EDS: the shipped actuator with objects of other kinds; return its path."""
    text = shipped("eds/hydraulic_actuator.eds").read_text()
    head, _, tail = text.partition("[ManufacturerObjects]")
    count = int(tail.partition("SupportedObjects=")[2].split()[0])
    listed = "".join(f"{count + n}=0x{o[0]:04X}\n" for n, o in enumerate(_OBJECTS, start=1))
    tail = tail.replace(
        f"SupportedObjects={count}\n", f"SupportedObjects={count + len(_OBJECTS)}\n"
    )
    tail = tail.replace(f"\n{count}=", f"\n{listed}{count}=", 1)
    objects = "".join(
        _OBJECT.format(index=index, name=name, data_type=data_type, access=access, rest=rest)
        for index, name, data_type, access, rest in _OBJECTS
    )
    path = folder / "every_service.eds"
    path.write_text(f"{head}[ManufacturerObjects]{tail}\n\n{objects}")
    return path

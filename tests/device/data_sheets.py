"""EDS files as makers write them: a minimal file, and objects that a test adds."""

from pathlib import Path

LEAST = """
[FileInfo]
FileName=device.eds
[DeviceInfo]
VendorName=Example
VendorNumber=0x0000029C
ProductNumber=7
RevisionNumber=0x00010002
BaudRate_250=1
BaudRate_500=1
NrOfRXPDO=0
NrOfTXPDO=1
[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0
[1001]
ParameterName=Error register
ObjectType=0x7
DataType=0x0005
AccessType=ro
[1018]
ParameterName=Identity
ObjectType=0x9
SubNumber=2
[1018sub0]
ParameterName=Highest sub-index supported
DataType=0x0005
AccessType=const
DefaultValue=1
[1018sub1]
ParameterName=Vendor-ID
DataType=0x0007
AccessType=ro
DefaultValue=0x0000029C
"""


def described(section: str, data_type: int, *lines: str, access: str = "rw") -> str:
    """Return the section of an object, with additional keys at its end."""
    head = f"[{section}]\nParameterName=object {section}\n"
    return head + "\n".join([f"DataType=0x{data_type:04X}", f"AccessType={access}", *lines]) + "\n"


def mapped(number: int, *words: str, cob_id: str = "", kind: int = 255) -> str:
    """Return the records of a TPDO with mapping words, event-driven by default."""
    communication, mapping = f"{0x17FF + number:04X}", f"{0x19FF + number:04X}"
    counted = described(f"{mapping}sub0", 5, f"DefaultValue={len(words)}")
    subs = [described(f"{mapping}sub{n}", 7, f"DefaultValue={w}") for n, w in enumerate(words, 1)]
    return "".join([
        f"[{communication}]\nParameterName=TPDO\nObjectType=9\nSubNumber=3\n",
        described(f"{communication}sub0", 5, "DefaultValue=2", access="const"),
        described(f"{communication}sub1", 7, f"DefaultValue={cob_id or '$NODEID+0x180'}"),
        described(f"{communication}sub2", 5, f"DefaultValue={kind}"),
        f"[{mapping}]\nParameterName=TPDO mapping\nObjectType=9\nSubNumber={len(words) + 1}\n",
        counted, *subs,
    ])  # fmt: skip


def written(folder: Path, *parts: str, encoding: str = "latin-1") -> Path:
    """Write the minimal EDS followed by these parts, and return its path."""
    path = folder / "device.eds"
    path.write_bytes((LEAST + "".join(parts)).encode(encoding))
    return path

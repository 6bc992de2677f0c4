"""A message as an ARXML file (AUTOSAR 4 system description), since cantools only reads these."""

from typing import Any

_ORDER = "<PACKING-BYTE-ORDER>MOST-SIGNIFICANT-BYTE-LAST</PACKING-BYTE-ORDER>"


def arxml(message: Any) -> str:
    """Return the text of a file with one message of cantools with little-endian signals."""
    signals = "".join(map(_signal, message.signals))
    mappings = "".join(
        f"<I-SIGNAL-TO-I-PDU-MAPPING><SHORT-NAME>m_{s.name}</SHORT-NAME>"
        f'<I-SIGNAL-REF DEST="I-SIGNAL">/p/{s.name}</I-SIGNAL-REF>{_ORDER}'
        f"<START-POSITION>{s.start}</START-POSITION></I-SIGNAL-TO-I-PDU-MAPPING>"
        for s in message.signals
    )
    units = "".join(
        f"<UNIT><SHORT-NAME>{unit}</SHORT-NAME><DISPLAY-NAME>{unit}</DISPLAY-NAME></UNIT>"
        for unit in sorted({s.unit for s in message.signals})
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<AUTOSAR xmlns="http://autosar.org/schema/r4.0"
 xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
 xsi:schemaLocation="http://autosar.org/schema/r4.0 AUTOSAR_4-2-2.xsd">
<AR-PACKAGES><AR-PACKAGE><SHORT-NAME>p</SHORT-NAME><ELEMENTS>
<CAN-CLUSTER><SHORT-NAME>bus</SHORT-NAME><CAN-CLUSTER-VARIANTS><CAN-CLUSTER-CONDITIONAL>
<BAUDRATE>1000000</BAUDRATE><PHYSICAL-CHANNELS><CAN-PHYSICAL-CHANNEL><SHORT-NAME>c</SHORT-NAME>
<FRAME-TRIGGERINGS><CAN-FRAME-TRIGGERING><SHORT-NAME>t</SHORT-NAME>
<FRAME-REF DEST="CAN-FRAME">/p/{message.name}</FRAME-REF>
<CAN-ADDRESSING-MODE>STANDARD</CAN-ADDRESSING-MODE><IDENTIFIER>{message.frame_id}</IDENTIFIER>
</CAN-FRAME-TRIGGERING></FRAME-TRIGGERINGS></CAN-PHYSICAL-CHANNEL></PHYSICAL-CHANNELS>
</CAN-CLUSTER-CONDITIONAL></CAN-CLUSTER-VARIANTS></CAN-CLUSTER>
<CAN-FRAME><SHORT-NAME>{message.name}</SHORT-NAME><FRAME-LENGTH>{message.length}</FRAME-LENGTH>
<PDU-TO-FRAME-MAPPINGS><PDU-TO-FRAME-MAPPING><SHORT-NAME>m</SHORT-NAME>
<PDU-REF DEST="I-SIGNAL-I-PDU">/p/pdu</PDU-REF>{_ORDER}<START-POSITION>0</START-POSITION>
</PDU-TO-FRAME-MAPPING></PDU-TO-FRAME-MAPPINGS></CAN-FRAME>
<I-SIGNAL-I-PDU><SHORT-NAME>pdu</SHORT-NAME><LENGTH>{message.length}</LENGTH>
<I-SIGNAL-TO-PDU-MAPPINGS>{mappings}</I-SIGNAL-TO-PDU-MAPPINGS></I-SIGNAL-I-PDU>
{signals}{units}</ELEMENTS></AR-PACKAGE></AR-PACKAGES></AUTOSAR>
"""


def _signal(s: Any) -> str:
    """Return a signal with its system signal and computation method."""
    bounded = s.maximum is not None
    scale = (
        f"<COMPU-SCALE>{_limits(0, round(s.maximum / s.scale)) if bounded else ''}"
        f"<COMPU-RATIONAL-COEFFS><COMPU-NUMERATOR><V>{s.offset}</V><V>{s.scale}</V>"
        "</COMPU-NUMERATOR><COMPU-DENOMINATOR><V>1</V></COMPU-DENOMINATOR>"
        "</COMPU-RATIONAL-COEFFS></COMPU-SCALE>"
    )
    words = "".join(
        f"<COMPU-SCALE>{_limits(value, value)}<COMPU-CONST><VT>{word}</VT></COMPU-CONST>"
        "</COMPU-SCALE>"
        for value, word in (s.choices or {}).items()
    )
    category = "SCALE_LINEAR_AND_TEXTTABLE" if words else "LINEAR"
    unit = f'<UNIT-REF DEST="UNIT">/p/{s.unit}</UNIT-REF>'
    return f"""<I-SIGNAL><SHORT-NAME>{s.name}</SHORT-NAME><LENGTH>{s.length}</LENGTH>
<SYSTEM-SIGNAL-REF DEST="SYSTEM-SIGNAL">/p/s_{s.name}</SYSTEM-SIGNAL-REF></I-SIGNAL>
<SYSTEM-SIGNAL><SHORT-NAME>s_{s.name}</SHORT-NAME><PHYSICAL-PROPS><SW-DATA-DEF-PROPS-VARIANTS>
<SW-DATA-DEF-PROPS-CONDITIONAL>
<COMPU-METHOD-REF DEST="COMPU-METHOD">/p/c_{s.name}</COMPU-METHOD-REF>
{unit}</SW-DATA-DEF-PROPS-CONDITIONAL></SW-DATA-DEF-PROPS-VARIANTS>
</PHYSICAL-PROPS></SYSTEM-SIGNAL>
<COMPU-METHOD><SHORT-NAME>c_{s.name}</SHORT-NAME><CATEGORY>{category}</CATEGORY>{unit}
<COMPU-INTERNAL-TO-PHYS><COMPU-SCALES>{scale}{words}</COMPU-SCALES></COMPU-INTERNAL-TO-PHYS>
</COMPU-METHOD>
"""


def _limits(low: int, high: int) -> str:
    return (
        f'<LOWER-LIMIT INTERVAL-TYPE="CLOSED">{low}</LOWER-LIMIT>'
        f'<UPPER-LIMIT INTERVAL-TYPE="CLOSED">{high}</UPPER-LIMIT>'
    )

"""Who offers which requests."""

from hil_emulator.protocol.base import Request
from hil_emulator.protocol.line import MessagesRequest, SendRequest
from hil_emulator.protocol.operation import (
    MarkerRequest,
    NmtRequest,
    PlayRequest,
    RecordRequest,
    SdoRequest,
)
from hil_emulator.protocol.page import (
    LogRequest,
    PaintedRequest,
    RowRequest,
    ViewRequest,
    WatchRequest,
)
from hil_emulator.protocol.rig import (
    EndRequest,
    FaultRequest,
    SetRequest,
    SignalsRequest,
    StatusRequest,
)

Requests = tuple[type[Request], ...]

OF_RIG: Requests = (StatusRequest, SignalsRequest, FaultRequest, EndRequest, SetRequest)
"""What both the control port and the panel offer; the loop answers it."""
OF_OPERATOR: Requests = (NmtRequest, SdoRequest, RecordRequest, MarkerRequest, PlayRequest)
"""What only the panel offers: its process acts on the bench."""
OF_PAGE: Requests = (ViewRequest, WatchRequest, LogRequest, RowRequest, PaintedRequest)
"""What concerns a single page of the panel."""
OF_PANEL: Requests = (*OF_RIG, *OF_OPERATOR, *OF_PAGE)
READING: Requests = (StatusRequest, SignalsRequest, *OF_PAGE)
"""What changes nothing: a panel that only shows offers it, too."""
TO_LOOP: Requests = (*OF_RIG, SendRequest, MessagesRequest)
"""What the loop answers."""

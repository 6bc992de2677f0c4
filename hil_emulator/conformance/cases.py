"""The cases by chapter: number and requirement.

A case is one test function marked with its number. Reports are made from the table here; a test
checks that table and functions agree.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import pytest

MARK = "conformance_case"

Test = TypeVar("Test", bound=Callable[..., Any])


OWN = 301
"""First number of additional cases in a chapter of the test tool."""


class Case(NamedTuple):
    """One case.

    Attributes:
        chapter: 1 to 10 as in the test tool, 11 and 12 are additional.
        number: within the chapter.
        subject: the service that is tested, such as "SDO 07".
        name: the requirement on the device.

    """

    chapter: int
    number: int
    subject: str
    name: str

    @property
    def label(self) -> str:
        """Chapter and number in the form of the test tool, such as 2.7."""
        return f"{self.chapter}.{self.number}"


CHAPTERS = {
    1: "EDS",
    2: "SDO",
    3: "PDO",
    4: "Object dictionary",
    5: "Emergency",
    6: "Synchronization",
    7: "Error control",
    8: "Storing and others",
    9: "NMT states",
    10: "NMT transitions",
    11: "LSS",
    12: "TIME",
}

_NAMES: dict[tuple[int, str, int], tuple[str, ...]] = {
    # chapter, subject, first number: names from there on
    (1, "EDS checker", 0): ("describe the device by a correct EDS",),
    (2, "SDO", 1): (
        "answer a read of the device type in one frame",
        "return the values written to the communication parameters",
        "refuse to write the device type",
        "refuse to read write-only objects",
        "refuse a sub-index that does not exist",
        "refuse an object that does not exist",
        "refuse an unknown command specifier",
        "refuse data longer than the object",
        "refuse data shorter than the object",
        "refuse values above the range",
        "refuse values below the range",
        "use the predefined SDO identifiers",
        "accept no segment after an expedited answer",
        "accept the guard time in segments",
        "accept the heartbeat time in segments",
        "announce the size of a segmented upload",
        "refuse a toggle bit that does not toggle",
        "upload an object in segments",
        "upload the device type as a block",
        "accept the guard time as a block",
        "accept the heartbeat time as a block",
        "upload a string as a block",
        "upload a block with a checksum",
        "accept the guard time as a block with a checksum",
        "accept the heartbeat time as a block with a checksum",
        "refuse blocks of 128 segments",
        "refuse an acknowledgement of segment 128",
        "have exactly the additional SDO servers of the EDS",
        "keep the additional SDO servers over a reset of communication",
        "keep the SDO clients over saving and a reset of communication",
    ),
    (2, "SDO integrity", OWN): (
        "accept an expedited download without a size",
        "name the object in each answer and abort",
        "refuse a download whose toggle bit does not toggle",
        "leave the object unchanged when the client aborts",
        "abort a transfer whose client stops sending",
        "refuse segments of another length than announced",
        "answer a client that restarts a transfer",
        "serve an additional channel at its configured identifiers",
        "refuse a block with a wrong checksum",
        "refuse a block of another length than announced",
        "accept no segment of a block after a lost segment",
        "send as many segments as the client requests",
        "set reserved bytes of confirmations to 0",
        "refuse segments longer or shorter than the object",
        "refuse sub-indices beyond the last",
        "refuse to write objects that do not exist",
        "end an upload with its last segment",
    ),
    (3, "PDO", 1): (
        "have exactly the RPDOs of the EDS",
        "have exactly the TPDOs of the EDS",
        "OPERATIONAL: send a TPDO on a remote frame",
        "OPERATIONAL: send a TPDO on an event",
        "OPERATIONAL: send a TPDO by its event timer",
        "OPERATIONAL: send a TPDO at every n-th SYNC",
        "OPERATIONAL: send an acyclic TPDO only at SYNC",
        "OPERATIONAL: start at the SYNC start value",
        "STOPPED: send no TPDO on a remote frame",
        "STOPPED: send no TPDO on an event",
        "STOPPED: send no TPDO by its event timer",
        "STOPPED: send no TPDO at SYNC",
        "STOPPED: send no acyclic TPDO",
        "STOPPED: send no TPDO at the SYNC start value",
        "PRE-OPERATIONAL: send no TPDO on a remote frame",
        "PRE-OPERATIONAL: send no TPDO on an event",
        "PRE-OPERATIONAL: send no TPDO by its event timer",
        "PRE-OPERATIONAL: send no TPDO at SYNC",
        "PRE-OPERATIONAL: send no acyclic TPDO",
        "PRE-OPERATIONAL: send no TPDO at the SYNC start value",
        "map by default only existing, mappable objects",
        "accept a new mapping by the procedure",
        "refuse a new entry while the number of entries is not 0",
        "refuse a new entry while the PDO is valid",
        "refuse more objects than the PDO can have",
        "refuse objects that exceed the length of a PDO",
        "map a process output into an RPDO",
        "refuse a process input in an RPDO",
        "refuse objects that are not mappable in an RPDO",
        "map a process input into a TPDO",
        "refuse a process output in a TPDO",
        "refuse objects that are not mappable in a TPDO",
        "accept dummy entries in an RPDO",
    ),
    (3, "PDO payload", OWN): (
        "show the mapped objects in a TPDO",
        "show in a TPDO the value written to an object",
        "store the values of an RPDO in its objects",
        "PRE-OPERATIONAL and STOPPED: ignore RPDOs",
        "apply a synchronous RPDO with the next SYNC",
        "accept a synchronous RPDO inside the window",
        "report an RPDO that is too short, and ignore its data",
        "use the first bytes of an RPDO that is too long",
        "report an RPDO that is overdue",
        "show the values of the last SYNC on a remote frame",
        "send an acyclic TPDO only after an event",
        "not report an RPDO as overdue before its first reception",
        "report an RPDO that is overdue again",
        "drop a synchronous RPDO on leaving OPERATIONAL",
        "apply the last of several synchronous RPDOs, once",
        "ignore an RPDO that does not exist",
    ),
    (3, "PDO parameters", OWN + 20): (
        "keep the identifier of a PDO that exists",
        "use the configured identifier of a PDO",
        "refuse reserved transmission types",
        "keep the inhibit time of a PDO that exists",
        "keep the SYNC start value of a PDO that exists",
        "refuse a mapping entry that is longer than its object",
        "answer no remote frame if the COB-ID excludes RTR",
        "send the next event when the inhibit time is over",
        "use a new event timer at once",
        "send an event-driven TPDO on a remote frame",
        "wait for the SYNC start value each time OPERATIONAL is entered",
    ),
    (4, "OD", 1): (
        "give access to the objects by their access types",
        "have the default values of the EDS",
        "refuse to write read-only objects",
        "refuse to read write-only objects",
        "show the structure of the EDS in sub-index 255",
        "keep the limits of the EDS",
        "OPERATIONAL: give access to the objects by their access types",
        "OPERATIONAL: have the default values of the EDS",
        "OPERATIONAL: return the values written",
    ),
    (5, "Emergency", 1): (
        "send emergencies with the identifier of the EDS",
        "show a consistent error register",
        "have no error in the history after a reset",
        "send an emergency for an error",
        "show the error in the error register",
        "enter the emergency in the error history",
    ),
    (5, "Emergency service", OWN): (
        "STOPPED: send no emergency",
        "send the error reset when all errors have ended",
        "report a persistent error only once",
        "enter the newest error first",
        "clear the error history on command",
        "send emergencies with the configured identifier, or not at all",
        "keep the inhibit time between emergencies",
        "clear each error when its cause has ended",
        "restart the error history after it was cleared",
        "show communication errors in the error register",
        "clear errors with a reset",
    ),
    (6, "Synchronization", 1): (
        "consume the predefined SYNC",
        "produce SYNC at the cycle period, or refuse to produce it",
        "send as many synchronous TPDOs as there are SYNCs",
        "consume SYNC with the cycle period 0",
        "refuse an invalid counter overflow",
        "accept SYNC without a counter",
        "count SYNC from 1 to the overflow",
        "keep the counter overflow over a restart",
        "lock the counter overflow while there is a cycle period",
        "keep all SYNC parameters over a restart",
    ),
    (6, "SYNC message", OWN): (
        "report a SYNC of the wrong length",
        "STOPPED: produce no SYNC",
        "keep the identifier of a SYNC that it produces",
        "start the SYNC counter at 1",
        "stop producing SYNC when it is switched off",
    ),
    (7, "Guarding", 1): (
        "have guard time and life time factor of the EDS",
        "answer a guarding request with the state",
        "toggle from answer to answer",
        "answer only at the identifier of its node-ID",
        "accept guard time and life time factor",
        "report a master that stopped guarding",
    ),
    (7, "Heartbeat", 101): (
        "accept the heartbeat time",
        "send heartbeats at the heartbeat time",
        "send no heartbeat when it is 0",
        "refuse to monitor a node twice",
        "report no error while heartbeats arrive in time",
        "report heartbeats that arrive too late",
        "stop monitoring a node with a reset",
    ),
    (7, "Heartbeat versus guarding", 201): (
        "have both services, or abort the access to a missing one",
        "send no heartbeat when it is 0",
        "answer guarding while the heartbeat is off",
        "send heartbeats while guarding is off",
        "answer no guarding request while the heartbeat is on",
        "prefer the heartbeat when both are configured",
        "answer no guarding request when both are configured",
    ),
    (7, "Error control", OWN): (
        "send heartbeats from boot-up on",
        "report a lost heartbeat neither early nor late",
        "not monitor a node before its first heartbeat",
        "apply the error behaviour",
        "answer guarding requests with each state",
        "wait for the life time",
        "monitor the node of each entry",
        "monitor a node again after its return",
        "stop monitoring a node whose entry is 0",
        "apply the error behaviour after life guarding",
        "continue the toggle bit over changes of state",
    ),
    (8, "Testing other", 1): (
        "refuse to save without the signature",
        "save with the signature, and keep the values over a restart",
        "refuse to restore without the signature",
        "restore with the signature, from the next reset on",
        "refuse to save communication parameters without the signature",
        "save communication parameters",
        "refuse to restore communication parameters without the signature",
        "restore communication parameters",
        "keep the date of the configuration",
        "refuse restricted identifiers",
    ),
    (8, "Storing scope", OWN): (
        "save only communication parameters",
        "save only application parameters",
        "restore only communication parameters",
        "restore only application parameters",
        "show its storage capability",
    ),
    (9, "State", 1): (
        "boot with default parameters",
        "enter PRE-OPERATIONAL by itself after boot-up",
        "serve SDO and PDO in OPERATIONAL",
        "serve only error control in STOPPED",
    ),
    (9, "NMT message", OWN): (
        "ignore NMT messages of another length than two bytes",
        "ignore unknown NMT commands",
        "not read a 29-bit identifier as an 11-bit identifier",
    ),
    (9, "Reset scope", OWN + 20): (
        "reset only communication parameters by reset communication",
        "reset all parameters by reset node",
        "send one boot-up message for each reset",
    ),
    (10, "Transition", 1): (
        "reset from every state",
        "enter PRE-OPERATIONAL from every state",
        "enter OPERATIONAL from every state",
        "enter STOPPED from every state",
    ),
    (11, "LSS", 1): (
        "answer inquiries with its identity",
        "answer no request in waiting state",
        "be selected only by its complete identity",
        "answer an identification whose range includes it",
        "refuse node-IDs that do not exist",
        "use a new node-ID from reset communication on, not before",
        "refuse a bit timing that does not exist",
        "not answer requests for nodes without a node-ID",
        "leave configuration state with a reset",
        "not use a refused node-ID",
        "answer with reserved bytes of 0",
    ),
    (12, "TIME", 1): (
        "have the TIME identifier of the EDS",
        "show the TIME received",
        "ignore TIME without bit 31 of 0x1012",
        "ignore TIME of another length than six bytes",
        "send TIME messages as far apart as their times",
        "continue from the TIME received, in days since 1984",
    ),
}

CASES: dict[str, Case] = {
    f"{chapter}.{first + n}": Case(
        chapter, first + n, f"{subject} {n + 1:02}" if first else subject, name
    )
    for (chapter, subject, first), names in _NAMES.items()
    for n, name in enumerate(names)
}
"""Every case by its label."""


def case(label: str) -> Callable[[Test], Test]:
    """Mark a test function as the case with this label, such as "2.7"."""
    mark = getattr(pytest.mark, MARK)(label)

    def decorate(test: Test) -> Test:
        marked: Test = mark(test)
        return marked

    return decorate

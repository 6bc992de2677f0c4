"""The cases: number and what each is about, by chapter.

A case is one test function marked with its number; the table here is what a report is made of,
and a test holds the two together.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import pytest

MARK = "conformance_case"

Test = TypeVar("Test", bound=Callable[..., Any])


OWN = 301
"""First number of the cases in a chapter of the test tool that the tool does not have."""


class Case(NamedTuple):
    """One case.

    Attributes:
        chapter: 1 to 10 as in the test tool, 11 and 12 of our own.
        number: within the chapter.
        subject: what it is about, such as "SDO 07".
        name: what the device has to do.

    """

    chapter: int
    number: int
    subject: str
    name: str

    @property
    def label(self) -> str:
        """Chapter and number as the test tool writes them, such as 2.7."""
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
    (1, "EDS checker", 0): ("describe the device by a sound EDS",),
    (2, "SDO", 1): (
        "answer a read of the device type in one frame",
        "give back what is written to the communication parameters",
        "refuse to write the device type",
        "refuse to read what is write-only",
        "refuse a sub-index that does not exist",
        "refuse an object that does not exist",
        "refuse an unknown command specifier",
        "refuse data longer than the object",
        "refuse data shorter than the object",
        "refuse values above the range",
        "refuse values below the range",
        "use the predefined SDO identifiers",
        "take no segment after an expedited answer",
        "take the guard time in segments",
        "take the heartbeat time in segments",
        "announce the size of a segmented upload",
        "refuse a toggle bit that does not toggle",
        "upload an object in segments",
        "upload the device type as a block",
        "take the guard time as a block",
        "take the heartbeat time as a block",
        "upload a string as a block",
        "upload a block with a checksum",
        "take the guard time as a block with a checksum",
        "take the heartbeat time as a block with a checksum",
        "refuse blocks of 128 segments",
        "refuse an acknowledgement of segment 128",
        "have exactly the additional SDO servers of the EDS",
        "keep them over a reset of communication",
        "keep the SDO clients over saving and a reset of communication",
    ),
    (2, "SDO integrity", OWN): (
        "take an expedited download that does not say its size",
        "name the object in each answer and abort",
        "refuse a download whose toggle bit does not toggle",
        "leave the object alone when the client aborts",
        "abort a transfer whose client falls silent",
        "refuse segments of another length than announced",
        "answer a client that begins anew",
        "serve an additional channel at the identifiers it is given",
        "refuse a block with a wrong checksum",
        "refuse a block of another length than announced",
        "take no segment of a block after a lost one",
        "send as many segments as the client asks for",
        "leave reserved bytes of confirmations 0",
        "refuse segments longer or shorter than the object",
        "refuse sub-indices beyond the last",
        "refuse to write what does not exist",
        "end an upload with its last segment",
    ),
    (3, "PDO", 1): (
        "have exactly the RPDOs of the EDS",
        "have exactly the TPDOs of the EDS",
        "OPERATIONAL: send a TPDO on a remote frame",
        "OPERATIONAL: send a TPDO on an event",
        "OPERATIONAL: send a TPDO by its event timer",
        "OPERATIONAL: send a TPDO at every n-th SYNC",
        "OPERATIONAL: send an acyclic TPDO at no other time than a SYNC",
        "OPERATIONAL: begin at the SYNC start value",
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
        "map by default only what exists and may be mapped",
        "take a new mapping by the procedure",
        "refuse a new entry while entries are counted",
        "refuse a new entry while the PDO is valid",
        "refuse more objects than the PDO can have",
        "refuse objects that are longer than the PDO together",
        "map a process output into an RPDO",
        "refuse a process input in an RPDO",
        "refuse what is not mappable in an RPDO",
        "map a process input into a TPDO",
        "refuse a process output in a TPDO",
        "refuse what is not mappable in a TPDO",
        "let dummies fill an RPDO",
    ),
    (3, "PDO payload", OWN): (
        "show the mapped objects in a TPDO",
        "show in a TPDO what has been written to an object",
        "store in its objects what an RPDO carries",
        "PRE-OPERATIONAL and STOPPED: take no RPDO",
        "apply a synchronous RPDO with the next SYNC",
        "take a synchronous RPDO inside the window",
        "report an RPDO that is too short, and take nothing of it",
        "take the first bytes of an RPDO that is too long",
        "report an RPDO that is overdue",
        "show the values of the last SYNC on a remote frame",
        "send an acyclic TPDO after an event alone",
        "report no RPDO as overdue that never came",
        "report an RPDO that is overdue again",
        "forget a synchronous RPDO on leaving OPERATIONAL",
        "apply the last of several synchronous RPDOs, once",
        "take no RPDO that does not exist",
    ),
    (3, "PDO parameters", OWN + 20): (
        "keep the identifier of a PDO that exists",
        "use the identifier a PDO is given",
        "refuse reserved transmission types",
        "keep the inhibit time of a PDO that exists",
        "keep the SYNC start value of a PDO that exists",
        "refuse a mapping entry that is longer than its object",
        "answer no remote frame where the COB-ID forbids it",
        "send the next event when the inhibit time is over",
        "use a new event timer at once",
        "send an event-driven TPDO on a remote frame",
        "wait for the SYNC start value whenever OPERATIONAL begins",
    ),
    (4, "OD", 1): (
        "give access to the objects by their access types",
        "have the default values of the EDS",
        "refuse to write what is read-only",
        "refuse to read what is write-only",
        "tell the structure in sub-index 255 as the EDS does",
        "keep the limits of the EDS",
        "OPERATIONAL: give access to the objects by their access types",
        "OPERATIONAL: have the default values of the EDS",
        "OPERATIONAL: give back what is written",
    ),
    (5, "Emergency", 1): (
        "send emergencies with the identifier of the EDS",
        "show an error register that is consistent",
        "have no error in the history after a reset",
        "send an emergency when there is an error",
        "show the error in the error register",
        "remember the emergency that was sent",
    ),
    (5, "Emergency service", OWN): (
        "STOPPED: send no emergency",
        "send the error reset when all errors are gone",
        "report an error that stays but once",
        "remember the newest error first",
        "empty the error history on demand",
        "send emergencies with the identifier they are given, or none",
        "keep the inhibit time between emergencies",
        "clear each error when its cause is gone",
        "begin the history anew after it was emptied",
        "show communication errors in the error register",
        "forget errors with a reset",
    ),
    (6, "Synchronization", 1): (
        "listen to the predefined SYNC",
        "produce SYNC at the cycle period, or none",
        "send as many synchronous TPDOs as there are SYNCs",
        "consume SYNC with the cycle period 0",
        "refuse an invalid counter overflow",
        "take SYNC without a counter",
        "count SYNC from 1 to the overflow",
        "keep the counter overflow over a restart",
        "lock the counter overflow while there is a cycle period",
        "keep all SYNC parameters over a restart",
    ),
    (6, "SYNC message", OWN): (
        "report a SYNC of the wrong length",
        "STOPPED: produce no SYNC",
        "keep the identifier of a SYNC that it produces",
        "begin the SYNC counter with 1",
        "stop producing SYNC when it is switched off",
    ),
    (7, "Guarding", 1): (
        "have guard time and life time factor of the EDS",
        "answer a guarding request with the state",
        "toggle from answer to answer",
        "answer at its own identifier alone",
        "take guard time and life time factor",
        "report a master that stopped guarding",
    ),
    (7, "Heartbeat", 101): (
        "take the heartbeat time",
        "send heartbeats at the heartbeat time",
        "send no heartbeat when it is 0",
        "refuse to watch one node twice",
        "be content while heartbeats come in time",
        "report heartbeats that come too late",
        "forget the watched node with a reset",
    ),
    (7, "Heartbeat versus guarding", 201): (
        "have both, or say by abort which is missing",
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
        "watch no node that was never heard",
        "obey the error behaviour",
        "answer guarding requests with each state",
        "wait for the life time",
        "watch the node of each entry",
        "watch a node again that is back",
        "stop watching a node whose entry is 0",
        "obey the error behaviour after life guarding",
        "toggle through the states",
    ),
    (8, "Testing other", 1): (
        "refuse to save without the signature",
        "save with the signature, and keep it over a restart",
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
        "save communication parameters alone",
        "save application parameters alone",
        "restore communication parameters alone",
        "restore application parameters alone",
        "show what it can store",
    ),
    (9, "State", 1): (
        "boot with default parameters",
        "enter PRE-OPERATIONAL by itself after boot-up",
        "serve SDO and PDO in OPERATIONAL",
        "serve error control alone in STOPPED",
    ),
    (9, "NMT message", OWN): (
        "ignore NMT messages of another length than two bytes",
        "ignore unknown NMT commands",
        "take no 29-bit identifier for one of 11 bits",
    ),
    (9, "Reset scope", OWN + 20): (
        "reset communication parameters alone by reset communication",
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
        "answer nothing in waiting state",
        "be selected by its whole identity alone",
        "be identified by a range it is in",
        "refuse node-IDs that do not exist",
        "use a new node-ID after reset communication, no sooner",
        "refuse a bit timing that does not exist",
        "keep to itself what is for nodes without a node-ID",
        "leave configuration state with a reset",
        "take no refused node-ID",
        "answer with reserved bytes of 0",
    ),
    (12, "TIME", 1): (
        "have the TIME identifier of the EDS",
        "show the TIME it is told",
        "ignore TIME where 0x1012 says so",
        "ignore TIME of another length than six bytes",
        "tell the time as it passes",
        "go on from the TIME it received, in days since 1984",
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

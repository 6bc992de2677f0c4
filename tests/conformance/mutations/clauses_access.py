"""SDO, dictionary, storing and LSS by clause (CiA 301 7.2.4, 7.5.2.13, 7.5.2.14; CiA 305)."""

from typing import Any

from hil_emulator.device import lss, storage
from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.datatype import DATA_TYPES, DataType
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.device.lss import LssSlave
from hil_emulator.device.nmt import Command
from hil_emulator.device.nmt_slave import NmtSlave
from hil_emulator.device.sdo import SdoServer
from hil_emulator.device.sdo_block import BlockDownload, BlockUpload
from hil_emulator.device.sdo_segmented import SegmentedDownload, SegmentedUpload
from hil_emulator.device.storage import RESTORE_PARAMETERS, ParameterStore
from mutations.mutant import Call, mutant

RUBBISH, DOMAIN = b"\xaa", 0x0F

# -- SDO ----------------------------------------------------------------------------------------


@mutant((SdoServer, "_initiate_download"))
def sdo_download_reserved_bytes(
    initiate: Call, server: SdoServer, data: bytes, index: int, subindex: int
) -> None:
    """Reserved bytes of an answer to a download are 0: they repeat the request."""
    initiate(server, data, index, subindex)
    server._answers.append(server._answers.pop()[:4] + RUBBISH * 4)


@mutant((SegmentedDownload, "request"))
def sdo_segment_reserved_bytes(request: Call, transfer: SegmentedDownload, data: bytes) -> Any:
    """Reserved bytes of an answer to a segment are 0: they are not."""
    return [answer[:1] + RUBBISH * 7 for answer in request(transfer, data)]


@mutant((BlockDownload, "request"))
def sdo_block_reserved_bytes(request: Call, transfer: BlockDownload, data: bytes) -> Any:
    """Reserved bytes of an answer in a block download are 0: they are not."""
    answers = request(transfer, data)
    return [a[: 1 if a[0] == 0xA1 else 3] + RUBBISH * (7 if a[0] == 0xA1 else 5) for a in answers]


@mutant((DataType, "check_length"))
def sdo_three_bytes_for_four(check: Call, kind: DataType, length: int) -> None:
    """Data shorter than the object are refused (0607 0013): a byte may be missing."""
    if not (kind.size == 4 and length == 3):
        check(kind, length)


@mutant((SegmentedDownload, "request"))
def sdo_long_segments_cut(request: Call, transfer: SegmentedDownload, data: bytes) -> Any:
    """Segments longer than the object are refused (0607 0012): they are cut."""
    answers = _of_any_length(request, transfer, data)
    if transfer.done:
        transfer.received = transfer.received[: transfer.size or None]  # type: ignore[attr-defined]
    return answers


@mutant((SegmentedDownload, "request"))
def sdo_short_segments_filled(request: Call, transfer: SegmentedDownload, data: bytes) -> Any:
    """Segments shorter than the object are refused (0607 0013): zeros are added."""
    answers = _of_any_length(request, transfer, data)
    if transfer.done:
        transfer.received = transfer.received.ljust(transfer.size, b"\0")  # type: ignore[attr-defined]
    return answers


def _of_any_length(request: Call, transfer: SegmentedDownload, data: bytes) -> Any:
    """Take a segment as that of a DOMAIN; `size` keeps the length of the object."""
    if not hasattr(transfer, "size"):
        transfer.size = transfer._kind.size  # type: ignore[attr-defined]
        transfer._kind = DATA_TYPES[DOMAIN]
    return request(transfer, data)


@mutant((Dictionary, "upload"), (Dictionary, "read"))
def sdo_subindex_beyond_the_last(
    read: Call, dictionary: Dictionary, index: int, subindex: int = 0
) -> Any:
    """A sub-index that a record does not have is 0609 0011: it is read as its sub-index 0."""
    beyond = 1 < subindex < 255 and dictionary.get(index, subindex) is None
    return read(dictionary, index, 0 if beyond and dictionary.get(index, 1) else subindex)


@mutant((SdoServer, "_initiate_download"))
def sdo_absent_object_written(
    initiate: Call, server: SdoServer, data: bytes, index: int, subindex: int
) -> None:
    """A write to an object that does not exist is 0602 0000: it is confirmed."""
    if index in server._dictionary:
        initiate(server, data, index, subindex)
    else:
        server._answers.append(b"\x60" + data[1:4] + bytes(4))


@mutant((SdoServer, "_initiate_download"))
def sdo_absent_subindex_written(
    initiate: Call, server: SdoServer, data: bytes, index: int, subindex: int
) -> None:
    """A write to a sub-index that does not exist is 0609 0011: it is confirmed."""
    absent = server._dictionary.get(index, subindex) is None
    if index in server._dictionary and absent:
        server._answers.append(b"\x60" + data[1:4] + bytes(4))
    else:
        initiate(server, data, index, subindex)


@mutant((Dictionary, "write"))
def sdo_refused_value_kept(
    write: Call, dictionary: Dictionary, index: int, subindex: int, value: Any
) -> None:
    """A refused value leaves the object as it was: it has the value."""
    try:
        write(dictionary, index, subindex, value)
    except SdoAbort as abort:
        entry = dictionary.get(index, subindex)
        if entry is not None and abort.code in (AbortCode.VALUE_TOO_HIGH, AbortCode.VALUE_TOO_LOW):
            entry.value = value
        raise


@mutant((Dictionary, "writable"))
def sdo_read_only_takes_and_refuses(
    writable: Call, dictionary: Dictionary, index: int, subindex: int
) -> Any:
    """What is read-only keeps its value: it is 0 after a refused write."""
    try:
        return writable(dictionary, index, subindex)
    except SdoAbort:
        entry = dictionary.get(index, subindex)
        if entry is not None and entry.type.numeric:
            entry.value = 0
        raise


@mutant((SegmentedUpload, "request"))
def sdo_upload_one_byte_short(request: Call, transfer: SegmentedUpload, data: bytes) -> Any:
    """An upload has all bytes of the object: the last segment has one less."""
    (answer,) = request(transfer, data)
    unused = answer[0] >> 1 & 7
    if answer[0] & 1 and unused < 6:
        answer = bytes([answer[0] & ~0x0E | unused + 1 << 1]) + answer[1:]
    return [answer]


@mutant((SegmentedUpload, "request"))
def sdo_segments_without_end(request: Call, transfer: SegmentedUpload, data: bytes) -> Any:
    """The segment after the last is aborted (0504 0001): it is empty."""
    answers = request(transfer, data)
    transfer.done = False
    return answers


@mutant((SdoServer, "request"))
def sdo_second_channel_answers_on_the_first(
    request: Call, server: SdoServer, now_ns: int, data: bytes
) -> None:
    """Each channel answers with its own identifier: all with that of the first."""
    request(server, now_ns, data)
    server._answer_can_id = 0x580 + server._dictionary.node_id


@mutant((SdoServer, "_abort"))
def sdo_abort_code_reversed(
    abort: Call, server: SdoServer, index: int, subindex: int, code: AbortCode
) -> None:
    """The least significant byte of an abort code comes first: it comes last."""
    abort(server, index, subindex, code)
    answer = server._answers.pop()
    server._answers.append(answer[:4] + answer[:3:-1])


@mutant((BlockUpload, "_next"))
def sdo_block_end_without_acknowledge(
    proceed: Call, transfer: BlockUpload, sequence: int, block_size: int
) -> Any:
    """A block upload ends when all is acknowledged: when all has been sent."""
    return proceed(transfer, transfer._sent, block_size)


@mutant((Entry, "writable"))
def sdo_constants_written(writable: Call, entry: Entry) -> Any:
    """A constant is not written (0601 0002): it is."""
    return entry.access == "const" or writable(entry)


# -- storing ------------------------------------------------------------------------------------


@mutant((ParameterStore, "changed"))
def restore_communication_restores_all(changed: Call, store: ParameterStore, entry: Entry) -> None:
    """Sub-index 2 of 0x1011 restores communication parameters: all."""
    changed(store, entry)
    if (entry.index, entry.subindex) == (RESTORE_PARAMETERS, 2):
        store._storage.save({})


@mutant((ParameterStore, "changed"))
def restore_application_restores_all(changed: Call, store: ParameterStore, entry: Entry) -> None:
    """Sub-index 3 of 0x1011 restores application parameters: all."""
    changed(store, entry)
    if (entry.index, entry.subindex) == (RESTORE_PARAMETERS, 3):
        store._storage.save({})


@mutant((storage, "ON_COMMAND"))
def store_shows_its_signature(on_command: int) -> int:
    """0x1010 reads as what the device can do: as the signature that was written."""
    return int.from_bytes(b"save", "little")


@mutant((ParameterStore, "_parameters"))
def store_all_leaves_application_out(
    parameters: Call, store: ParameterStore, indices: range
) -> Any:
    """Sub-index 1 of 0x1010 saves all parameters: those of communication."""
    stored = parameters(store, indices)
    return {key: data for key, data in stored.items() if key[0] < 0x2000}


# -- LSS and resets -----------------------------------------------------------------------------


@mutant((LssSlave, "activate"))
def lss_configuration_over_reset(activate: Call, slave: LssSlave) -> Any:
    """A reset ends configuration state: it goes on."""
    configuring = slave._configuring
    node_id = activate(slave)
    slave._configuring = configuring
    return node_id


@mutant((LssSlave, "_answer"))
def lss_reserved_bytes(answer: Call, slave: LssSlave, service: int, data: bytes = b"") -> None:
    """Reserved bytes of an LSS answer are 0: they are not."""
    slave.answers.append(bytes([service]) + data.ljust(7, RUBBISH))


@mutant((lss, "_REFUSED"))
def lss_refusal_without_error(refused: int) -> int:
    """A node-ID that does not exist is answered with an error: without an error."""
    return 0


@mutant((LssSlave, "_configure"))
def lss_refused_node_id_taken(configure: Call, slave: LssSlave, service: int, value: int) -> None:
    """A refused node-ID changes nothing: it counts from the next reset on."""
    configure(slave, service, value)
    if service == 0x11 and value > 127:
        slave.pending = value & 0x7F or 1


@mutant((LssSlave, "_switch"))
def lss_switch_global_answered(switch: Call, slave: LssSlave, configuring: bool) -> None:
    """Switch global is not answered: it is."""
    switch(slave, configuring)
    slave._answer(0x04)


@mutant((NmtSlave, "request"))
def nmt_reset_communication_without_boot_up(
    request: Call, slave: NmtSlave, now_ns: int, data: bytes
) -> None:
    """Both resets end with a boot-up: reset communication changes nothing in PRE-OPERATIONAL."""
    if data[:1] != bytes([Command.RESET_COMMUNICATION]):
        request(slave, now_ns, data)

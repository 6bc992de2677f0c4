"""SDO: expedited, segmented and block transfers, and their aborts (CiA 301 7.2.4)."""

from typing import Any

from hil_emulator.device import sdo, sdo_block, sdo_segmented
from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.datatype import DataType
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.device.sdo import SDO_SERVER_PARAMETER, SdoServer
from hil_emulator.device.sdo_block import BlockDownload, BlockUpload
from hil_emulator.device.sdo_channels import SdoChannels
from hil_emulator.device.sdo_segmented import SegmentedDownload, SegmentedUpload
from hil_emulator.frame import Frame
from mutations.mutant import Call, mutant

REQUEST = (SdoServer, "request")
INITIATE_DOWNLOAD = (SdoServer, "_initiate_download")
TOGGLE, LAST, ABORT, UPLOAD = 0x10, 0x80, 0x80, 0x40


# -- requests and aborts ----------------------------------------------------------------------


@mutant(REQUEST)
def sdo_unknown_command_unanswered(take: Call, server: SdoServer, now_ns: int, data: bytes) -> None:
    """An unknown command specifier is aborted (0504 0001): there is no answer."""
    if data[0] < 0xE0:
        take(server, now_ns, data)


@mutant((sdo, "TIMEOUT_NS"))
def sdo_never_times_out(timeout_ns: int) -> int:
    """A transfer whose client is silent is aborted (0504 0000): it waits for ever."""
    return 1 << 62


@mutant(REQUEST)
def sdo_abort_of_client_ignored(take: Call, server: SdoServer, now_ns: int, data: bytes) -> None:
    """An abort ends the transfer: it goes on."""
    if data[0] != ABORT:
        take(server, now_ns, data)


@mutant(REQUEST)
def sdo_abort_completes_download(take: Call, server: SdoServer, now_ns: int, data: bytes) -> None:
    """An aborted download leaves the object as it was: it has what had come."""
    transfer = server._transfer
    if transfer is not None and transfer.received and data[0] == ABORT:
        entry = server._dictionary.entry(transfer.index, transfer.subindex)
        entry.value = entry.type.decode(transfer.received)
    take(server, now_ns, data)


@mutant(REQUEST)
def sdo_abort_answered(take: Call, server: SdoServer, now_ns: int, data: bytes) -> None:
    """An abort is not confirmed: it is answered by one."""
    take(server, now_ns, data)
    if data[0] == ABORT:
        server._abort(0, 0, AbortCode.GENERAL_ERROR)


@mutant((SdoServer, "_abort"))
def sdo_abort_names_no_object(
    abort: Call, server: SdoServer, index: int, subindex: int, code: AbortCode
) -> None:
    """An abort names index and sub-index of its transfer: zeros."""
    abort(server, 0, 0, code)


@mutant(REQUEST)
def sdo_new_request_lost(take: Call, server: SdoServer, now_ns: int, data: bytes) -> None:
    """A client may begin anew without an abort: a new upload is lost during a download."""
    busy = isinstance(server._transfer, SegmentedDownload)
    if not busy or data[0] & 0xE0 != UPLOAD:
        take(server, now_ns, data)


@mutant((SdoServer, "publish"))
def sdo_answers_without_padding(
    publish: Call, server: SdoServer, now_ns: int, frames: list[Frame]
) -> None:
    """An SDO has eight bytes: zeros at its end are left out."""
    server._answers = [answer.rstrip(b"\0") for answer in server._answers]
    publish(server, now_ns, frames)


@mutant((SdoChannels, "add_routes"))
def sdo_further_server_deaf(add: Call, channels: SdoChannels, routes: dict[int, Any]) -> None:
    """A server of 0x1201 listens to the identifier it is given: it is deaf."""
    server = channels._servers[SDO_SERVER_PARAMETER]
    routes[server.request_can_id] = [channels._receiver(server)]


# -- access -----------------------------------------------------------------------------------


@mutant((Dictionary, "read"), (Dictionary, "upload"))
def sdo_subindex_of_variables_ignored(
    read: Call, dictionary: Dictionary, index: int, subindex: int = 0
) -> Any:
    """A variable has sub-index 0 alone (0609 0011): any is read as if it were 0."""
    return read(dictionary, index, subindex if dictionary.get(index, 1) else 0)


@mutant((Dictionary, "entry"))
def sdo_absent_subindex_told_as_object(
    entry: Call, dictionary: Dictionary, index: int, subindex: int = 0
) -> Any:
    """A missing sub-index is 0609 0011, a missing object 0602 0000: the latter is for both."""
    if dictionary.get(index, subindex) is None:
        raise SdoAbort(AbortCode.NO_SUCH_OBJECT)
    return entry(dictionary, index, subindex)


@mutant((Entry, "writable"))
def sdo_read_only_written(writable: Call, entry: Entry) -> bool:
    """What is read-only is not written (0601 0002): it is."""
    return True


@mutant((Entry, "readable"))
def sdo_write_only_read(readable: Call, entry: Entry) -> bool:
    """What is write-only is not read (0601 0001): it is."""
    return True


@mutant((Entry, "check"))
def sdo_high_limit_ignored(check: Call, entry: Entry, value: Any) -> None:
    """Values above the limit are refused (0609 0031): they are taken."""
    if not entry.type.numeric or value <= entry.bounds[1]:
        check(entry, value)


@mutant((Entry, "check"))
def sdo_low_limit_ignored(check: Call, entry: Entry, value: Any) -> None:
    """Values below the limit are refused (0609 0032): they are taken."""
    if not entry.type.numeric or value >= entry.bounds[0]:
        check(entry, value)


@mutant((DataType, "decode"))
def sdo_long_data_cut(decode: Call, kind: DataType, data: bytes) -> Any:
    """Data longer than the object are refused (0607 0012): they are cut."""
    return decode(kind, data[: kind.size or len(data)])


@mutant((DataType, "decode"))
def sdo_short_data_filled(decode: Call, kind: DataType, data: bytes) -> Any:
    """Data shorter than the object are refused (0607 0013): zeros are added."""
    return decode(kind, data.ljust(kind.size, b"\0"))


# -- expedited and segmented ------------------------------------------------------------------


@mutant(INITIATE_DOWNLOAD)
def sdo_expedited_needs_a_size(
    download: Call, server: SdoServer, data: bytes, index: int, subindex: int
) -> None:
    """The size of an expedited download is optional: without a size it is refused."""
    if data[0] & 3 == 2:
        raise SdoAbort(AbortCode.UNKNOWN_COMMAND)
    download(server, data, index, subindex)


@mutant(INITIATE_DOWNLOAD)
def sdo_download_answer_names_no_object(
    download: Call, server: SdoServer, data: bytes, index: int, subindex: int
) -> None:
    """The answer to a download names the object: zeros."""
    download(server, data, index, subindex)
    server._answers[-1] = server._answers[-1][:1] + bytes(7)


@mutant((SegmentedDownload, "request"))
def sdo_download_toggle_unchecked(take: Call, transfer: SegmentedDownload, data: bytes) -> Any:
    """The toggle bit alternates (0503 0000): a download takes a segment twice."""
    return take(transfer, bytes([data[0] & ~TOGGLE | transfer._toggle]) + data[1:])


@mutant((SegmentedUpload, "request"))
def sdo_upload_toggle_unchecked(take: Call, transfer: SegmentedUpload, data: bytes) -> Any:
    """The toggle bit alternates (0503 0000): an upload goes on whatever it is."""
    return take(transfer, bytes([data[0] & ~TOGGLE | transfer._toggle]) + data[1:])


@mutant((SegmentedDownload, "request"))
def sdo_download_answers_never_toggle(take: Call, transfer: SegmentedDownload, data: bytes) -> Any:
    """The server repeats the toggle bit of a segment: it is 0 always."""
    return [bytes([answer[0] & ~TOGGLE]) + answer[1:] for answer in take(transfer, data)]


@mutant((sdo_segmented, "check_announced"))
def sdo_announced_size_unchecked(check: Call, announced: int | None, length: int) -> None:
    """Segments hold as many bytes as were announced (0607 0010): they may hold others."""


@mutant((SegmentedUpload, "request"))
def sdo_unused_bytes_unsaid(take: Call, transfer: SegmentedUpload, data: bytes) -> Any:
    """A segment has its number of unused bytes: the number is 0."""
    return [bytes([answer[0] & ~0x0E]) + answer[1:] for answer in take(transfer, data)]


# -- block ------------------------------------------------------------------------------------


@mutant((BlockDownload, "__init__"))
def sdo_block_checksum_unchecked(init: Call, *given: Any, checked: bool) -> None:
    """A wrong checksum aborts a block download (0504 0004): it is not looked at."""
    init(*given, checked=False)


@mutant((sdo_block, "check_announced"))
def sdo_block_announced_size_unchecked(check: Call, announced: int | None, length: int) -> None:
    """A block download holds as many bytes as were announced (0607 0010): or others."""


@mutant((sdo, "check_block_size"), (sdo_block, "check_block_size"))
def sdo_block_of_128_segments(check: Call, size: int) -> int:
    """A block has 127 segments at most (0504 0002): a client may ask for more."""
    return size


@mutant((BlockDownload, "_segment"))
def sdo_block_sequence_unchecked(take: Call, transfer: BlockDownload, data: bytes) -> Any:
    """Segments after a lost one are not taken: they are stored, with a gap."""
    return take(transfer, bytes([data[0] & LAST | transfer._sequence + 1]) + data[1:])


@mutant((BlockDownload, "_segment"))
def sdo_block_sequence_zero_ignored(take: Call, transfer: BlockDownload, data: bytes) -> Any:
    """Sequence numbers are 1 to 127 (0504 0003): 0 is passed over in silence."""
    return take(transfer, data) if data[0] & 0x7F else []


@mutant((BlockDownload, "_end"))
def sdo_block_padding_kept(end: Call, transfer: BlockDownload, data: bytes) -> Any:
    """The end has the number of unused bytes in the last segment: all bytes are used."""
    transfer._size = None
    return end(transfer, bytes([data[0] & ~0x1C]) + data[1:])


@mutant((BlockUpload, "_next"))
def sdo_block_checksum_missing(proceed: Call, transfer: BlockUpload, *given: int) -> Any:
    """A block upload ends with the checksum of its data: with 0."""
    answers = proceed(transfer, *given)
    return [a[:1] + bytes(7) for a in answers] if transfer._ended else answers


@mutant((BlockUpload, "_next"))
def sdo_block_never_repeated(proceed: Call, transfer: BlockUpload, sequence: int, size: int) -> Any:
    """A block begins after the last segment acknowledged: what was lost is not sent again."""
    return proceed(transfer, transfer._sent, size)


@mutant((BlockUpload, "_block"))
def sdo_block_size_of_client_ignored(send: Call, transfer: BlockUpload) -> Any:
    """The client sets the number of segments of a block: it is 127."""
    transfer._block_size = sdo_block.MAX_BLOCK
    return send(transfer)


@mutant((BlockUpload, "_next"))
def sdo_block_size_stays(proceed: Call, transfer: BlockUpload, sequence: int, size: int) -> Any:
    """Each acknowledgement has the size of the next block: the first one stays."""
    return proceed(transfer, sequence, transfer._block_size)

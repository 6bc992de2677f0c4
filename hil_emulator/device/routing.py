"""Routes of frames to services in each state of a node (CiA 301 7.3.2.2)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from hil_emulator.device.error_control import ERROR_CONTROL_COB_ID
from hil_emulator.device.fast_path import Routes, leaving_first
from hil_emulator.device.heartbeat_consumer import HeartbeatConsumer
from hil_emulator.device.lss import LSS_REQUEST
from hil_emulator.device.nmt import NMT_COB_ID, State
from hil_emulator.device.rpdo import Handler
from hil_emulator.device.services import Services


@dataclass(frozen=True)
class Routing:
    """The routes of a node in one state.

    Attributes:
        data: of data frames.
        remote: of remote frames.
        fast_data: of data frames on the fast path.
        fast_remote: of remote frames there.
        sync: handler of SYNC.
        hears: identifiers of all accepted data frames, and whether the frame may change this
            table.

    """

    data: Routes
    remote: Routes
    fast_data: Routes
    fast_remote: Routes
    sync: Handler
    hears: Mapping[int, bool]


def routing_of(
    services: Services,
    node_id: int,
    state: State,
    nmt: Handler,
    leave: Callable[[], None],
) -> Routing:
    """Return the routes to a node's services.

    Args:
        services: handle the frames.
        node_id: of the node.
        state: NMT state of the node.
        nmt: handles commands of the NMT master.
        leave: leaves the fast path.

    """
    data: dict[int, list[Handler]] = {}
    remote: dict[int, list[Handler]] = {}
    if state is not State.OPERATIONAL:
        data[LSS_REQUEST] = [services.lss.request]
    if state is not State.INITIALISING:
        data[NMT_COB_ID] = [nmt]
    communicates = state in (State.PRE_OPERATIONAL, State.OPERATIONAL)
    if communicates:
        services.sdo.add_routes(data)
    rerouting = set(data)
    if state is not State.INITIALISING:
        remote[ERROR_CONTROL_COB_ID + node_id] = [services.guarding.request]
        for partner in services.consumer.node_ids:
            data[ERROR_CONTROL_COB_ID + partner] = [_heard(services.consumer, partner)]
    if communicates and services.time.can_id is not None:
        data.setdefault(services.time.can_id, []).append(services.time.receive)
    others = set(data)
    operational = state is State.OPERATIONAL
    sync = services.pdos.sync_handler() if operational else services.sync.handler()
    if communicates and services.sync.can_id is not None:
        data.setdefault(services.sync.can_id, []).append(sync)
    if operational:
        services.pdos.add_routes(data, remote)
    hears = {can_id: can_id in rerouting for can_id in data}
    routes, asked = _joined(data), _joined(remote)
    fast = leaving_first(routes, leave, set(data) - others), leaving_first(asked, leave)
    return Routing(routes, asked, *fast, sync, hears)


def _heard(consumer: HeartbeatConsumer, node_id: int) -> Handler:
    """Return the handler of another node's heartbeat."""

    def handle(now_ns: int, data: bytes) -> None:
        if len(data) == 1:
            consumer.heard(now_ns, node_id)

    return handle


def _joined(routes: Mapping[int, Sequence[Handler]]) -> Routes:
    """Return one handler for each identifier, which calls all handlers of the identifier."""
    return {i: h[0] if len(h) == 1 else _in_turn(h) for i, h in routes.items()}


def _in_turn(handlers: Sequence[Handler]) -> Handler:
    def handle(now_ns: int, data: bytes) -> None:
        for handler in handlers:
            handler(now_ns, data)

    return handle

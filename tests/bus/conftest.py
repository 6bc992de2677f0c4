"""The wires of the contract."""

import itertools
from collections.abc import Iterator

import pytest
from wires import Wire

_numbers = itertools.count()


@pytest.fixture(
    params=["virtual", "socketcand_server", pytest.param("socketcan", marks=pytest.mark.vcan)]
)
def wire(request: pytest.FixtureRequest) -> Iterator[Wire]:
    """Yield each kind of bus that a rig can use."""
    if request.param == "virtual":
        settings = {"interface": "virtual", "channel": f"wire-{next(_numbers)}"}
        wire = Wire(settings, node_settings=settings)
    elif request.param == "socketcand_server":
        wire = Wire({"interface": "socketcand_server", "port": 0})
    else:
        channel = request.getfixturevalue("socketcan_channel")
        wire = Wire({"interface": "socketcan", "channel": channel})
    try:
        yield wire
    finally:
        wire.close()

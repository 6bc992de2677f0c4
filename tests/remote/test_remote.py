"""Remote control of a running emulator, as a script and as a browser would use it."""

import http.client
import json
import socket
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from hil_emulator.errors import UserError
from hil_emulator.platform.paths import shipped
from hil_emulator.remote.client import request


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    """Yield the port of an emulator under the wall clock."""
    process = start("0")
    assert process.stdout is not None
    line = next(line for line in process.stdout if line.startswith("control"))
    next(line for line in process.stdout if "Ctrl-C ends." in line)
    number = int(line.rpartition(":")[2])
    yield number
    process.terminate()
    assert process.wait(timeout=30) == 0
    with pytest.raises(UserError, match="no emulator answers"):
        request(number, "GET", "/status")


def start(port: str, *options: str) -> subprocess.Popen[str]:
    """Return an emulator with a remote control."""
    command = [sys.executable, "-m", "hil_emulator", "run", str(shipped("configs/hyq_knee.toml"))]
    return subprocess.Popen(
        [*command, "--bus", "virtual:remote", "--control", port, *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def ctl(port: int, *words: str) -> subprocess.CompletedProcess[str]:
    """Run `hil-emulator ctl`."""
    command = [sys.executable, "-m", "hil_emulator", "ctl", "--port", str(port), *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def value(port: int, name: str) -> float:
    """Return a signal's present value."""
    return float(request(port, "GET", f"/signals?name={name}")["signals"][name]["value"])


def until(port: int, name: str, low: float, high: float) -> None:
    """Wait until a signal is in a band."""
    deadline = time.monotonic() + 20.0
    while not low < value(port, name) < high:
        assert time.monotonic() < deadline, f"{name} is {value(port, name)}"
        time.sleep(0.02)


def test_a_fault_begins_and_ends_at_a_word(port: int) -> None:
    """The supply is lost while the loop runs, listed, and back when it is ended."""
    assert "fault" in ctl(port, "fault", "supply", "droop", "drop=60 bar").stdout
    until(port, "supply_pressure", 95e5, 105e5)
    (listed,) = request(port, "GET", "/status")["faults"]
    assert listed["fault"] == "supply droop, drop 60 bar"
    assert f"ended [{listed['number']}]" in ctl(port, "end").stdout
    until(port, "supply_pressure", 155e5, 165e5)


def test_supply_and_load_can_be_set(port: int) -> None:
    """The signals follow; `read` prints them with their units."""
    assert ctl(port, "set", "supply_pressure", "120 bar").returncode == 0
    until(port, "supply_pressure", 115e5, 125e5)
    request(port, "PUT", "/settings", {"supply_pressure": "160 bar", "external_force": "200 N"})
    until(port, "external_force", 199.0, 201.0)
    text = ctl(port, "read", "external_force").stdout
    assert text.split()[-3:] == ["external_force", "200", "N"]


def test_a_set_point_is_written_into_the_node(port: int) -> None:
    """As an SDO client would; beyond the object's limit it is refused."""
    assert request(port, "PUT", "/settings", {"valve_current": "1 mA"})["set"]
    with pytest.raises(UserError, match="valve_current: 5 is refused"):
        request(port, "PUT", "/settings", {"valve_current": "5 A"})


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("fault", "supply", "stuck"), "supply cannot have 'stuck'"),
        (("fault", "pressure_a", "offset", "value=3"), "a pressure is wanted"),
        (("fault", "pressure_a", "offset", "3"), "is not NAME=VALUE"),
        (("set", "temperature", "3"), "no setting 'temperature'"),
        (("read", "speed"), "no signal 'speed'"),
        (("end", "99"), "no fault number 99"),
        (("jump",), "not understood; write one of"),
    ],
)
def test_a_mistake_is_one_message(port: int, words: tuple[str, ...], message: str) -> None:
    """The same messages as everywhere, exit code 2; the loop goes on."""
    result = ctl(port, *words)
    assert result.returncode == 2
    assert message in result.stderr
    before = request(port, "GET", "/status")["time"]
    time.sleep(0.1)
    assert request(port, "GET", "/status")["time"] > before


def answer(port: int, method: str, path: str, body: bytes = b"", **headers: str) -> int:
    """Return the status of a request with headers of one's own."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request(method, path, body, {k.replace("_", "-"): v for k, v in headers.items()})
    status = connection.getresponse().status
    connection.close()
    return status


def http_json(
    port: int, method: str, path: str, body: bytes = b""
) -> tuple[int, dict[str, object]]:
    """Return status and JSON of a request."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    connection.request(method, path, body, {"Content-Type": "application/json"})
    response = connection.getresponse()
    assert response.headers["Content-Type"] == "application/json"
    content = json.loads(response.read())
    connection.close()
    return response.status, content


FAULT = '{"target": "supply", "kind": "droop", %s}'
SUPPLY = '{"supply_pressure": %s}'
DEEP = "[" * 981 + "]" * 981


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("PUT", "/settings", '{"valve_current": "1e300 A"}'),
        ("PUT", "/settings", '{"supply_pressure": "inf bar"}'),
        ("PUT", "/settings", '{"supply_pressure": "1e308 bar"}'),
        ("PUT", "/settings", '{"supply_pressure": "9**9**8 bar"}'),
        ("PUT", "/settings", '{"external_force": "-1e9 N"}'),
        ("PUT", "/settings", '{"supply_pressure": 1e999}'),
        ("PUT", "/settings", '{"supply_pressure": NaN}'),
        ("PUT", "/settings", SUPPLY % ("9" * 4000)),
        ("PUT", "/settings", SUPPLY % ("9" * 5000)),
        ("PUT", "/settings", SUPPLY % DEEP),
        ("PUT", "/settings", DEEP * 30),
        ("POST", "/faults", FAULT % '"seed": 1e999'),
        ("POST", "/faults", FAULT % '"probability": 1e999'),
        ("POST", "/faults", FAULT % f'"probability": {"9" * 4000}'),
        ("POST", "/faults", FAULT % '"duration": "1e305 s"'),
        ("POST", "/faults", FAULT % '"start": "1e305 s"'),
        ("POST", "/faults", FAULT % '"condition": 5'),
        ("POST", "/faults", FAULT % '"drop": "1e305 bar"'),
        ("POST", "/faults", FAULT.replace('"supply"', "%s") % (DEEP, '"seed": 1')),
        ("POST", "/faults", '{"target": 5, "kind": "droop"}'),
        ("POST", "/faults", '{"target": "supply", "kind": null}'),
        ("POST", "/faults", '{"target": "node5.pressure_a", "kind": "stuck"}'),
        ("POST", "/faults", '{"target": "node5.pressure_a", "kind": "offset", "value": "1 bar"}'),
        ("POST", "/faults", '{"target": "node%s", "kind": "silence"}' % ("9" * 5000)),
        ("POST", "/faults", '{"target": "0x%s185", "kind": "drop"}' % ("0" * 30_000)),
        ("POST", "/faults", FAULT % f'"probability": "{" " * 33_000}0"'),
        ("POST", "/faults", FAULT % f'"{"x" * 1000}": 1'),
        ("POST", "/faults", FAULT % ", ".join(f'"n{i}": 1' for i in range(17))),
        ("POST", "/faults", FAULT % '"do": "end"'),
        ("DELETE", "/faults/" + "9" * 5000, ""),
        ("DELETE", "/faults7", ""),
        ("DELETE", "/faults/-1", ""),
        ("GET", "//[", ""),
        ("GET", "/signals?name=" + "x" * 60_000, ""),
        ("PATCH", "/settings", "{}"),
        ("BREW", "/", ""),
    ],
    ids=lambda value: value[:60],
)
def test_a_hostile_request_is_one_sentence(port: int, method: str, path: str, body: str) -> None:
    """Whatever it holds: 4xx, an error in JSON, and the loop goes on as if nothing had been."""
    before = request(port, "GET", "/status")
    status, content = http_json(port, method, path, body.encode())
    assert 400 <= status < 500
    assert list(content) == ["error"]
    assert "Traceback" not in str(content)
    after = request(port, "GET", "/status")
    assert after["faults"] == before["faults"]
    assert after["time"] > before["time"]
    assert 155e5 < value(port, "supply_pressure") < 165e5


def test_a_request_is_obeyed_as_a_whole_or_not_at_all(port: int) -> None:
    """Where the node refuses its set point, the supply stays as it was."""
    with pytest.raises(UserError, match="valve_current: 5 is refused"):
        request(port, "PUT", "/settings", {"supply_pressure": "90 bar", "valve_current": "5 A"})
    time.sleep(0.1)
    assert 155e5 < value(port, "supply_pressure") < 165e5


def test_other_origins_are_refused(port: int) -> None:
    """A page of another site, a host name rebound to this machine, a body that is no JSON."""
    body = json.dumps({"target": "supply", "kind": "loss"}).encode()
    kind = "application/json"
    assert (
        answer(port, "POST", "/faults", body, Content_Type=kind, Origin="http://evil.test") == 403
    )
    assert answer(port, "GET", "/signals", Origin="null") == 403
    assert answer(port, "GET", "/signals", Host="evil.test") == 403
    assert answer(port, "POST", "/faults", body, Content_Type="text/plain") == 415
    assert answer(port, "POST", "/faults", b"{", Content_Type=kind) == 400
    assert answer(port, "POST", "/faults", b"[]", Content_Type=kind) == 400
    assert answer(port, "PUT", "/settings", b'{"supply_pressure": []}', Content_Type=kind) == 400
    assert answer(port, "GET", "/nothing") == 404
    assert answer(port, "GET", "/signals", Origin=f"http://127.0.0.1:{port}") == 200
    assert request(port, "GET", "/status")["faults"] == []


@pytest.mark.parametrize("version", [b" HTTP/2.0", b" HTTP/1.x", b" FTP/1.1", b""])
def test_a_version_that_is_not_spoken_is_answered_like_any_mistake(
    port: int, version: bytes
) -> None:
    """A status line, and in JSON what is wrong: a client that parses HTTP can read it."""
    with socket.create_connection(("127.0.0.1", port), timeout=20) as client:
        client.sendall(b"GET /status" + version + b"\r\n\r\n")
        head, _, body = b"".join(iter(lambda: client.recv(1 << 16), b"")).partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.0 4")
    assert list(json.loads(body)) == ["error"]


def test_the_status_says_how_far_time_has_slipped(port: int) -> None:
    """A controller that measures times against its own clock has to know."""
    assert request(port, "GET", "/status")["slipped"] >= 0.0
    assert "s behind real time" in ctl(port, "status").stdout


def test_it_listens_on_this_machine_only(port: int) -> None:
    """No other address of this machine accepts a connection."""
    with socket.socket() as probe:
        probe.settimeout(2)
        assert probe.connect_ex(("127.0.0.2", port)) != 0


def test_it_is_off_unless_asked_for(port: int) -> None:
    """Without --control there is no line about it in the output, and no process."""
    command = [sys.executable, "-m", "hil_emulator", "run", str(shipped("configs/hyq_knee.toml"))]
    options = ["--bus", "virtual:off", "--clock", "lockstep", "--duration", "10 ms"]
    result = subprocess.run([*command, *options], capture_output=True, text=True, check=True)
    assert "control" not in result.stdout


@pytest.mark.slow
def test_a_port_in_use_is_one_message(port: int) -> None:
    """The second emulator at the same port ends with one message."""
    process = start(str(port))
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 2
    assert f"--control {port}: " in errors
    assert "choose another port" in errors

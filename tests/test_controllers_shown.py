"""The controllers that docs/how_to/controller.md shows, against the emulator, and its ROS 2 bus."""

import configparser
import shutil
import socket
import struct
import subprocess
import sys
from pathlib import Path

import can
import canopen
import pytest
from test_shown import block

import hil_emulator as hil
from hil_emulator.commands.export import contents
from hil_emulator.config.machine import load_machine
from hil_emulator.platform.paths import shipped

EDS = shipped("eds/hydraulic_actuator.eds")
CAN_FRAME = struct.Struct("<IB3x8s")
"""`struct can_frame` of linux/can.h: identifier, length, data."""

NO_KERNEL = """
int __wrap_socket(int family, int kind, int protocol) {
    return family == 29 && kind == 3 && protocol == 1 ? 0 : -1;  /* PF_CAN, SOCK_RAW, CAN_RAW */
}
int __wrap_ioctl(int file, unsigned long request, ...) { return file == 0 && request ? 0 : -1; }
int __wrap_bind(int file, const void *address, unsigned length) {
    return file == 0 && address && length ? 0 : -1;
}
"""
"""In place of a kernel with SocketCAN: the bus is standard input, a socket that keeps frames."""


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_the_controller_in_c_brings_the_rod_to_its_target(tmp_path: Path) -> None:
    """Strictly compiled, and each tick waits for its answer: 50 mm, from 40."""
    (tmp_path / "page.c").write_text(block("how_to/controller.md", "c", "#include"))
    (tmp_path / "no_kernel.c").write_text(NO_KERNEL)
    wrapped = [f"-Wl,--wrap={name}" for name in ("socket", "ioctl", "bind")]
    strict = ["-std=gnu11", "-O2", "-D_FORTIFY_SOURCE=2", "-Wall", "-Wextra", "-Werror"]
    compiler = ["cc", *strict, "page.c", "no_kernel.c", *wrapped, "-o", "controller"]
    subprocess.run(compiler, cwd=tmp_path, check=True)
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours.settimeout(30.0)

    def answer() -> can.Message:
        identifier, length, data = CAN_FRAME.unpack(ours.recv(CAN_FRAME.size))
        return can.Message(arbitration_id=identifier, data=data[:length], is_extended_id=False)

    with (
        hil.Rig("hyq_knee") as rig,
        can.Bus(**rig.bus) as bus,
        subprocess.Popen([tmp_path / "controller"], stdin=theirs) as controller,
    ):
        bus.send(answer())
        for _ in range(600):
            rig.tick()
            while message := bus.recv(0.0):
                identifier, data = message.arbitration_id, bytes(message.data)
                ours.send(CAN_FRAME.pack(identifier, message.dlc, data))
                if identifier == 0x285:
                    bus.send(answer())
        assert rig.signals.model.position == pytest.approx(0.05, abs=1e-3)
        ours.close()
        theirs.close()
        assert controller.wait(timeout=30.0) == 0


def test_ros_2_can_configure_the_bus(tmp_path: Path) -> None:
    """`dcfgen`, which ros2_canopen runs, makes of both files a master that knows the node."""
    pytest.importorskip("dcf", reason="dcf-tools is not installed")
    text = block("how_to/controller.md", "yaml", "master:")
    (tmp_path / "bus.yml").write_text(text)
    for name, content in contents(load_machine([shipped("configs/hyq_knee.toml")])).items():
        (tmp_path / name).write_text(content, encoding="latin-1")
    command = [Path(sys.executable).with_name("dcfgen"), "-r", "bus.yml"]
    made = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (made.returncode, made.stderr) == (0, "")
    master = configparser.ConfigParser()
    master.read(tmp_path / "master.dcf")
    asked_of_it = int(master["1F81Value"]["5"], 0)  # NMT slave assignment of the node
    assert asked_of_it & 1
    assert int(master["1F84Value"]["5"], 0) == canopen.import_od(str(EDS))[0x1000].default

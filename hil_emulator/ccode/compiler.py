"""C compilers: the one of this machine, and that of the package `ziglang` for other systems."""

import importlib.util
import platform
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-shared")
"""No fused multiply-add and no -ffast-math: every operation rounds as in the model."""


class CompilerError(Exception):
    """There is no compiler for a target, or the compiler failed; contains its message."""


@dataclass(frozen=True)
class System:
    """Target system of a shared library.

    Attributes:
        name: folder name of FMI 3.0 for processor and system.
        fmi2: folder name of FMI 2.0; "" if FMI 2.0 has no folder for it.
        suffix: ending of a shared library.
        triple: target name of `ziglang`; for Linux with a C library of 2012.

    """

    name: str
    fmi2: str
    suffix: str
    triple: str


LINUX = System("x86_64-linux", "linux64", ".so", "x86_64-linux-gnu.2.17")
WINDOWS = System("x86_64-windows", "win64", ".dll", "x86_64-windows-gnu")
TARGETS = (
    LINUX,
    WINDOWS,
    System("aarch64-linux", "", ".so", "aarch64-linux-gnu.2.17"),
    System("x86_64-darwin", "darwin64", ".dylib", "x86_64-macos"),
    System("aarch64-darwin", "", ".dylib", "aarch64-macos"),
)


def host() -> System | None:
    """Return this machine's system if it is in `TARGETS`, else None."""
    machine = {"AMD64": "x86_64", "arm64": "aarch64"}.get(platform.machine(), platform.machine())
    name = f"{machine}-{platform.system().lower()}"
    return next((target for target in TARGETS if target.name == name), None)


def build_library(
    sources: Sequence[Path], library: Path, target: System, flags: Sequence[str] = ()
) -> None:
    """Compile C files into a shared library.

    Args:
        sources: C files; their folder is searched for headers.
        library: shared library to write.
        target: system of the library.
        flags: flags in addition to `FLAGS`.

    Raises:
        CompilerError: if there is no compiler for the target, or the compiler reports an error.

    """
    position = [] if target is WINDOWS else ["-fPIC"]
    maths = [] if target is WINDOWS else ["-lm"]
    words = [
        *_compiler(target),
        *FLAGS,
        *flags,
        *position,
        "-o",
        str(library),
        *map(str, sources),
        *maths,
    ]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        raise CompilerError(f"{words[0]} failed: {done.stderr.strip()}")


def _compiler(target: System) -> list[str]:
    compiler = next((path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))), None)
    if compiler and target is host():
        return [compiler]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc", "-target", target.triple]
    raise CompilerError(
        f"no C compiler for {target.name}: pip install 'hil-emulator[cross]' brings one"
    )

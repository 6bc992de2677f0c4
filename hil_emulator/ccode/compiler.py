"""C compilers: the machine's own, and the one of the package `ziglang` for other systems."""

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
    """There is no compiler for a target, or it refused; says what it said."""


@dataclass(frozen=True)
class System:
    """A system that a shared library is made for.

    Attributes:
        name: processor and system, as FMI 3.0 calls its folder.
        fmi2: the same as FMI 2.0 calls it; "" where it has no word for it.
        suffix: ending of a shared library.
        triple: what `ziglang` calls it: for Linux a C library as old as of 2012.

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
    """Return the system that this is, where it is one of `TARGETS`."""
    machine = {"AMD64": "x86_64", "arm64": "aarch64"}.get(platform.machine(), platform.machine())
    name = f"{machine}-{platform.system().lower()}"
    return next((target for target in TARGETS if target.name == name), None)


def build_library(
    sources: Sequence[Path], library: Path, target: System, flags: Sequence[str] = ()
) -> None:
    """Compile C files into a shared library.

    Args:
        sources: the files; headers are looked for beside them.
        library: what becomes of them.
        target: the system that it is for.
        flags: further ones than `FLAGS`.

    Raises:
        CompilerError: if there is no compiler for that, or it finds an error.

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
        raise CompilerError(f"{words[0]} says: {done.stderr.strip()}")


def _compiler(target: System) -> list[str]:
    own = next((path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))), None)
    if own and target is host():
        return [own]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc", "-target", target.triple]
    raise CompilerError(
        f"no C compiler for {target.name}: pip install 'hil-emulator[cross]' brings one"
    )

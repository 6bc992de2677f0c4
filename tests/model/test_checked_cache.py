"""Machine code in damaged files."""

import errno
import os
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import pytest

from hil_emulator.model import checked_cache
from hil_emulator.model.compiling import entry_point
from hil_emulator.model.kernel import keep

SOURCE = "def tripled(x):\n    return 3.0 * x\n"


def start(file: Path) -> Any:
    """Return the function as a new process has it: compiled or loaded by its first call."""
    space: dict[str, Any] = {"__name__": __name__}
    exec(compile(SOURCE, str(file), "exec"), space)
    function = entry_point(file)(space["tripled"])
    assert function(2.0) == 6.0
    return function


def recompiled(file: Path) -> bool:
    """Return whether the function had to be compiled."""
    return bool(sum(start(file).stats.cache_misses.values()))


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the function's module and machine code."""
    folder = tmp_path_factory.mktemp("kernels")
    (folder / "module.py").write_text(SOURCE)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(numba.core.config, "CACHE_DIR", "")
        assert recompiled(folder / "module.py")
        assert not recompiled(folder / "module.py")
    return folder


@pytest.fixture
def module(filled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a module with its machine code in the same folder, to be damaged."""
    monkeypatch.setattr(numba.core.config, "CACHE_DIR", "")
    shutil.copytree(filled, tmp_path / "kernels")
    return tmp_path / "kernels" / "module.py"


def kept(module: Path, ending: str) -> Path:
    """Return the only file of machine code with an ending."""
    (file,) = (module.parent / "__pycache__").glob(f"*.{ending}")
    return file


def flipped(content: bytes) -> bytes:
    """Return data with one wrong bit in the midst."""
    at = len(content) // 2
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


def noise(content: bytes) -> bytes:
    """Return as many random bytes."""
    return random.Random(1).randbytes(len(content))


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda content: b"",
    "first half": lambda content: content[: len(content) // 2],
    "one bit": flipped,
    "random": noise,
    "longer": lambda content: content + b"\0",
}


@pytest.mark.parametrize("ending", ["nbi", "nbc", "sha256"])
@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_damaged_files_are_replaced(
    module: Path, ending: str, damage: Callable[[bytes], bytes]
) -> None:
    """The function is compiled once more, and loaded from then on."""
    file = kept(module, ending)
    file.write_bytes(damage(file.read_bytes()))
    assert [recompiled(module), recompiled(module)] == [True, False]


@pytest.mark.parametrize("ending", ["nbi", "nbc", "sha256"])
def test_a_missing_file_or_a_folder_in_its_place_is_replaced(module: Path, ending: str) -> None:
    """The function is compiled as for the first time."""
    file = kept(module, ending)
    file.unlink()
    assert [recompiled(module), recompiled(module)] == [True, False]
    file.unlink()
    file.mkdir()
    (file / "something").touch()
    assert [recompiled(module), recompiled(module)] == [True, False]


def test_code_that_cannot_be_unpickled_is_replaced(module: Path) -> None:
    """An intact file may refer to objects that no longer exist."""
    cache = start(module)._cache
    kept(module, "nbc").write_bytes(b"cno_such_module\nname\n.")
    kept(module, "sha256").write_text(cache._digest())
    assert [recompiled(module), recompiled(module)] == [True, False]


def test_damaged_files_that_stay_do_no_harm(module: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The function is compiled each time, as with files of another user in a shared folder."""
    kept(module, "nbi").write_bytes(b"\x80")
    monkeypatch.setattr(Path, "unlink", refusal)
    assert [recompiled(module), recompiled(module)] == [True, True]


def refusal(*_: object) -> None:
    """Fail as a full disk does."""
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize("failing", ["numba", "checksum"])
def test_a_full_disk_leaves_no_machine_code(
    module: Path, failing: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The function is compiled for this process alone."""
    kept(module, "nbi").unlink()
    if failing == "numba":
        monkeypatch.setattr(numba.core.caching.IndexDataCacheFile, "_save_data", refusal)
    else:
        monkeypatch.setattr(checked_cache, "write_whole", refusal)
    assert [recompiled(module), recompiled(module)] == [True, True]
    assert {file.suffix for file in (module.parent / "__pycache__").iterdir()} == {".lock"}


def test_without_a_folder_to_write_in_nothing_is_kept(
    module: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The function is compiled for this process alone, also where its lock is a folder."""
    kept(module, "lock").unlink()
    (module.parent / "__pycache__" / kept(module, "nbi").with_suffix(".lock").name).mkdir()
    assert not recompiled(module)
    monkeypatch.setattr(numba.core.caching._CacheLocator, "ensure_cache_path", refusal)
    assert [recompiled(module), recompiled(module)] == [True, True]


def test_a_damaged_module_is_written_again(tmp_path: Path) -> None:
    """It is written as it should be, or not at all where something else is in its place."""
    file = keep(SOURCE, tmp_path)
    assert file
    for damage in DAMAGES.values():
        file.write_bytes(damage(SOURCE.encode()))
        assert keep(SOURCE, tmp_path) == file
        assert file.read_text() == SOURCE
    file.unlink()
    file.mkdir()
    assert keep(SOURCE, tmp_path) is None
    assert list(tmp_path.iterdir()) == [file]

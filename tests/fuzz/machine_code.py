"""Kept machine code that has been damaged: it is loaded, or made anew, and ends no process."""

import os
import shutil
import sys
from pathlib import Path

from hil_emulator.bus.bus import Bus
from hil_emulator.errors import UserError
from hil_emulator.model import kernel
from hil_emulator.platform.paths import cache_folder
from hil_emulator.simulation.active_effects import acting_together
from hil_emulator.simulation.assembly import assemble, compiled

sys.path.append(str(Path(__file__).parents[1]))

from rigs import bench, reference

ENDINGS = (".nbi", ".nbc")
"""An index and the code of what it lists."""

_MADE_ANEW, _FAILED = 3, 4


_KERNEL = "*.tick_and_report-*"
"""Files of the entry that a rig calls in each tick."""


def kept(folder: Path) -> dict[str, list[bytes]]:
    """Return what is kept of the model by ending; `folder` gets a copy of the reference's cache."""
    with bench(reference()) as b:
        b.tick()
    (acting,) = acting_together([reference()])
    effects = acting.effects
    made = kernel.keep(compiled(effects, cache_folder(), 1).source, folder)
    assert made is not None
    source = cache_folder() / kernel.sources_digest(effects)
    (folder / "kernels" / source.name / "__pycache__").mkdir(parents=True)
    for file in source.rglob(f"{made.stem}*"):
        if file.is_file():
            shutil.copy2(file, folder / "kernels" / source.name / file.relative_to(source))
    files = {e: sorted((folder / "kernels").rglob(_KERNEL + e)) for e in ENDINGS}
    return {e.removeprefix("."): [file.read_bytes() for file in files[e]] for e in ENDINGS}


def read(file: Path) -> None:
    """Put a file in the place of a kept one, and load the model in a process of its own.

    Raises:
        UserError: the model has to be compiled again.
        RuntimeError: the process has ended otherwise.

    """
    cache = file.parent / "damaged kernels"
    shutil.rmtree(cache, ignore_errors=True)  # what is damaged may have been removed
    shutil.copytree(file.parent / "kernels", cache)
    next(cache.rglob(_KERNEL + file.suffix)).write_bytes(file.read_bytes())
    child = os.fork()
    if child == 0:
        os._exit(_loaded(cache))
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if status == _MADE_ANEW:
        raise UserError(f"{file}: is made anew")
    if status:
        raise RuntimeError(f"the process that loads the model has ended with {status}")


def _loaded(cache: Path) -> int:
    """Load the model; return how that ended."""
    from numba.core import compiler

    def stop(*_: object, **__: object) -> None:
        os._exit(_MADE_ANEW)

    compiler.compile_extra = stop
    try:
        bus = Bus({"interface": "virtual", "channel": "machine code"})
        assemble(reference(), bus, cache, None).step()
    except BaseException as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
        return _FAILED
    return 0

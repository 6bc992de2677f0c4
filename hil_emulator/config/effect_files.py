"""Effect files of the user: Python that declares effects and lists them in EFFECTS."""

import hashlib
import importlib.util
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from hil_emulator.model.declare import Effect

_PREFIX = "hil_emulator_effects_"

EffectFile = tuple[str, bytes]
"""Name and content of an effect file."""


def module_name(content: bytes) -> str:
    """Return the name of an effect file's module: kept machine code finds effects again by it."""
    return _PREFIX + hashlib.sha256(content).hexdigest()[:16]


def read_effects(path: Path) -> list[Effect]:
    """Import an effect file.

    Raises:
        Exception, SystemExit: whatever ends it, as it is anybody's Python; TypeError where EFFECTS
            is no list of effects.

    """
    spec = importlib.util.spec_from_file_location(module_name(path.read_bytes()), path)
    if spec is None or spec.loader is None:
        raise ImportError("not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[module.__name__] = module
    spec.loader.exec_module(module)
    effects = list(module.EFFECTS)
    for effect in effects:
        if not isinstance(effect, Effect):
            raise TypeError(f"{effect!r} in EFFECTS is no effect")
    return effects


def effect_files(effects: Sequence[Effect]) -> tuple[EffectFile, ...]:
    """Return the files that some of the effects come from, in the order of the effects."""
    names = dict.fromkeys(str(e.law.__module__) for e in effects)
    files = [_file(sys.modules[n]) for n in names if n.startswith(_PREFIX)]
    return tuple((file.name, file.read_bytes()) for file in files)


def restored(files: Sequence[EffectFile], folder: Path) -> list[Effect]:
    """Return the effects of files that come from elsewhere.

    Args:
        files: see `effect_files`.
        folder: where to write those that this process has not imported.

    """
    found: list[Effect] = []
    for i, (name, content) in enumerate(files):
        known = sys.modules.get(module_name(content))
        if known is not None:
            found += known.EFFECTS
            continue
        path = folder / str(i) / name
        path.parent.mkdir()
        path.write_bytes(content)
        found += read_effects(path)
    return found


def _file(module: ModuleType) -> Path:
    return Path(str(module.__file__))

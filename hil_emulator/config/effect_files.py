"""Effect files of the user: Python that declares effects and lists them in EFFECTS."""

import hashlib
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from hil_emulator.model.declare import Effect

_PREFIX = "hil_emulator_effects_"
_DIGEST = "__sha256__"

EffectFile = tuple[str, bytes]
"""Name and content of an effect file."""


def module_name(content: bytes) -> str:
    """Return the module name of an effect file, by which stored machine code finds its effects."""
    return _PREFIX + digest(content)[:16]


def read_effects(path: Path, content: bytes) -> list[Effect]:
    """Run exactly this content of an effect file, whatever was compiled from it before.

    Raises:
        Exception, SystemExit: any error of the file, which is the user's Python; TypeError if
            EFFECTS is not a list of effects.

    """
    module = ModuleType(module_name(content))
    module.__file__ = str(path)
    module.__dict__[_DIGEST] = digest(content)
    sys.modules[module.__name__] = module
    exec(compile(content, str(path), "exec"), module.__dict__)
    effects = list(module.EFFECTS)
    for effect in effects:
        if not isinstance(effect, Effect):
            raise TypeError(f"{effect!r} in EFFECTS is no effect")
    return effects


def digest(content: bytes) -> str:
    """Return the digest of an effect file."""
    return hashlib.sha256(content).hexdigest()


def digests(effects: Sequence[Effect]) -> dict[str, str]:
    """Return the names of the files that some of the effects come from, by their digests."""
    return {m.__dict__[_DIGEST]: _file(m).name for m in _modules(effects)}


def effect_files(effects: Sequence[Effect]) -> tuple[EffectFile, ...]:
    """Return the files that some of the effects come from, in the order of the effects."""
    files = [_file(module) for module in _modules(effects)]
    return tuple((file.name, file.read_bytes()) for file in files)


def restored(files: Sequence[EffectFile], folder: Path) -> list[Effect]:
    """Return the effects of files that come from elsewhere.

    Args:
        files: see `effect_files`.
        folder: where to write those that this process has not imported.

    """
    effects_of_files: list[Effect] = []
    for i, (name, content) in enumerate(files):
        module = sys.modules.get(module_name(content))
        if module is not None:
            effects_of_files += module.EFFECTS
            continue
        path = folder / str(i) / name
        path.parent.mkdir()
        path.write_bytes(content)
        effects_of_files += read_effects(path, content)
    return effects_of_files


def _modules(effects: Sequence[Effect]) -> list[ModuleType]:
    names = dict.fromkeys(str(e.law.__module__) for e in effects)
    return [sys.modules[n] for n in names if n.startswith(_PREFIX)]


def _file(module: ModuleType) -> Path:
    return Path(str(module.__file__))

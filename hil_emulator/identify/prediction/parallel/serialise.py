"""Serialisation of a predictor for another process, without machine code and effects.

The other process imports the same effects, and compiles the model or loads it from its cache.
"""

import io
import pickle
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock
from typing import Any

from hil_emulator.config.effect_files import EffectFile, effect_files, restored
from hil_emulator.errors import UserError
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.plant.machine_code import Loops, bind, digest
from hil_emulator.identify.prediction.plant.plant_model import probed
from hil_emulator.model.declare import Effect
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.kernel import Kernel
from hil_emulator.platform.paths import cache_folder

_building = Lock()


@dataclass(frozen=True)
class Serialised:
    """A serialised predictor.

    Attributes:
        state: pickled predictor, with code represented by name.
        effects: names of the effects of its model.
        files: effect files of the user.
        code: digest of the sender's code.

    """

    state: bytes
    effects: frozenset[str]
    files: tuple[EffectFile, ...]
    code: str


def serialised(predictor: Predictor) -> Serialised:
    """Return a serialised predictor."""
    kernel = predictor.model.kernel
    buffer = io.BytesIO()
    _Pickler(buffer, pickle.HIGHEST_PROTOCOL).dump(predictor)
    names = frozenset(effect.name for effect in kernel.effects)
    return Serialised(buffer.getvalue(), names, effect_files(kernel.effects), digest(kernel))


def deserialised(sent: Serialised) -> Predictor:
    """Return the predictor, built once per process.

    Raises:
        UserError: if this process has other code than the sender.

    """
    with _building:
        return _built(sent)


@lru_cache(maxsize=2)
def _built(sent: Serialised) -> Predictor:
    with TemporaryDirectory() as folder:
        users = restored(sent.files, Path(folder))
        chosen = tuple(effect for effect in (*CATALOGUE, *users) if effect.name in sent.effects)
        kernel = probed(chosen, cache_folder())
        if digest(kernel) != sent.code:
            raise UserError(
                "--cluster: hil-emulator, numba or numpy have another version on a worker than "
                "here; install the same, so that the results are the same"
            )
        loops = bind(kernel, cache_folder())
    # the configuration may name effects that are not compiled into the kernel
    effects = {effect.name: effect for effect in (*CATALOGUE, *users, *kernel.effects)}
    predictor: Predictor = _Unpickler(io.BytesIO(sent.state), effects, kernel, loops).load()
    return predictor


class _Pickler(pickle.Pickler):
    def persistent_id(self, obj: Any) -> tuple[str, str] | None:
        """Return the name that represents an object of code, or None."""
        if isinstance(obj, Effect):
            return "effect", obj.name
        if isinstance(obj, Kernel):
            return "kernel", ""
        return ("loops", "") if isinstance(obj, Loops) else None


class _Unpickler(pickle.Unpickler):
    def __init__(
        self, file: io.BytesIO, effects: Mapping[str, Effect], kernel: Kernel, loops: Loops
    ) -> None:
        super().__init__(file)
        self._effects, self._kernel, self._loops = effects, kernel, loops

    def persistent_load(self, pid: tuple[str, str]) -> Effect | Kernel | Loops:
        """Return the object of code for a name."""
        kind, name = pid
        if kind == "effect":
            return self._effects[name]
        return self._kernel if kind == "kernel" else self._loops

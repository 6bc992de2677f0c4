"""A predictor for another process: all but its machine code and its effects, which are code.

The other process imports the same effects and compiles the model, or finds it in its own cache.
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
    """A predictor that can travel.

    Attributes:
        state: the predictor; code in it is represented by name.
        effects: names of those that its model knows.
        files: effect files of the user.
        code: digest of the code that it ran with.

    """

    state: bytes
    effects: frozenset[str]
    files: tuple[EffectFile, ...]
    code: str


def serialised(predictor: Predictor) -> Serialised:
    """Return a predictor ready to travel."""
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
        own = restored(sent.files, Path(folder))
        known = tuple(effect for effect in (*CATALOGUE, *own) if effect.name in sent.effects)
        kernel = probed(known, cache_folder())
        if digest(kernel) != sent.code:
            raise UserError(
                "--cluster: hil-emulator, numba or numpy have another version on a worker than "
                "here; install the same, so that the results are the same"
            )
        loops = bind(kernel, cache_folder())
    # the configuration names effects that the machine's kernel need not know
    effects = {effect.name: effect for effect in (*CATALOGUE, *own, *kernel.effects)}
    predictor: Predictor = _Unpickler(io.BytesIO(sent.state), effects, kernel, loops).load()
    return predictor


class _Pickler(pickle.Pickler):
    def persistent_id(self, obj: Any) -> tuple[str, str] | None:
        """Return what stands for code."""
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
        """Return the code that stands for."""
        kind, name = pid
        if kind == "effect":
            return self._effects[name]
        return self._kernel if kind == "kernel" else self._loops

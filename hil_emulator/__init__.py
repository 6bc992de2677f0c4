"""Hardware-in-the-loop emulator of hydraulic actuation on CAN.

import hil_emulator as hil

knee = hil.load("hyq_knee")
table = knee.simulate(current="3 mA", duration="200 ms")
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import Any

__version__ = "0.1.0"

_HOMES = {
    "Actuator": "api.actuator:ActuatorModel",
    "Identification": "api.identification:Identification",
    "LinearModel": "api.linear_model:LinearModel",
    "Picture": "api.picture:Picture",
    "Rig": "api.lockstep:LockstepRig",
    "UserError": "errors:UserError",
    "gap": "api.identification:gap",
    "identify": "api.identification:identify",
    "load": "api.actuator:load",
    "machines": "api.actuator:machines",
    "play": "api.scenario:play",
    "read": "api.reading:read",
    "to_xarray": "api.tables:to_xarray",
}
"""Where each public name is found when it is first asked for; types stand in `__init__.pyi`."""

__all__ = ["__version__", *_HOMES]


class _Package(ModuleType):
    """A package of which some rooms have the name of a public function."""

    def __setattr__(self, name: str, value: Any) -> None:
        """Take what the import system puts here; what is called like a function can be called."""
        if name in _HOMES and isinstance(value, ModuleType):
            value.__class__ = _CallableRoom
        super().__setattr__(name, value)


class _CallableRoom(ModuleType):
    """Subpackage that is callable as the public function of its name: `identify`, `machines`."""

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return _public(self.__name__.rpartition(".")[2])(*args, **kwargs)


def _public(name: str) -> Any:
    module, _, attribute = _HOMES[name].partition(":")
    return getattr(import_module(f"{__name__}.{module}"), attribute)


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return _public(name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


sys.modules[__name__].__class__ = _Package

"""Meaning of the arguments of each command, which click does not store."""

_FILES = "configuration files (TOML) or names of packaged ones; later ones are laid over earlier"

_MEANINGS = {
    "files": _FILES,
    "recording": "journal of a run (`.rec`)",
    "completion shell": "shell to complete for",
    "ctl words": "request and its arguments, such as `set supply_pressure '120 bar'`",
    "panel path": "journal of a run (`.rec`), or the folder of `identify --out`",
    "plot signals": "signals to draw; without any, the sensor channels",
    "convert targets": "files to write; each ending decides the format",
    "init file": "configuration to write",
    "schema what": "kind of file that the schema describes",
    "characterise test": "`all`, or the name of a bench test",
    "scenario files": "scenario files (TOML) or names of packaged ones",
    "identify files": f"{_FILES}; then recorded data",
    "gap files": f"{_FILES}; then recorded data",
    "experiment name": "experiment of the library; without it, the library is listed",
    "hide effects": "effects to hide; `nothing` hides no effect",
}
"""By command and parameter, or by parameter alone if it means the same in every command."""


def meaning(command: str, parameter: str) -> str:
    """Return the meaning of an argument.

    Raises:
        KeyError: no meaning is declared for it.

    """
    return _MEANINGS.get(f"{command} {parameter}") or _MEANINGS[parameter]

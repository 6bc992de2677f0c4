"""`log_formats.md`: formats of measured data and recordings."""

import inspect

from build_time.reference.markdown import code, page, table, text
from hil_emulator.bus import log_endings
from hil_emulator.identify.measured.formats import FORMATS
from hil_emulator.recording import SUFFIX, exports
from hil_emulator.recording.format import EXTRA, Format

_HEAD = """\
Formats of files with measured data and recordings, by the endings of the files. An extra is
installed with `pip install 'hil-emulator[EXTRA]'`."""

_FRAMES = """\
The content of a file decides what it is, not its ending, and each may be packed (`.gz`). The nodes
of the configuration state what the frames mean; so do the options `--eds` and `--dbc`. A
message database is a DBC, KCD, SYM or ARXML file."""


def write() -> str:
    """Return the page."""
    return page(
        "Log formats",
        _HEAD,
        "## Read by identify and gap",
        "Columns of measured values:",
        table(("ending", "format", "names and units", "times", "extra"), _columns()),
        "Captures of CAN traffic:",
        table(("ending", "format"), _captures()),
        _FRAMES,
        f"The journal of the emulator ({code(SUFFIX)}) is read as well, by `replay`, `plot`, "
        "`convert` and `panel`, too.",
        "## Written by run --record and convert",
        table(("ending", "format", "extra"), _recordings()),
    )


def _captures() -> list[tuple[str, ...]]:
    kinds = [*log_endings.NAMES.items(), *log_endings.READ_ONLY.items()]
    return [(code(ending), text(name)) for ending, name in kinds]


def _columns() -> list[tuple[str, ...]]:
    return [
        (", ".join(map(code, f.endings)), text(f.name), text(f.labels), text(f.times),
         f"{f.library.extra} ({f.library.package})" if f.library else "")
        for f in FORMATS
    ]  # fmt: skip


def _recordings() -> list[tuple[str, ...]]:
    by_format = {id(f): f for f in exports.formats_by_ending().values()}
    journal = (code(SUFFIX), "journal: everything, for this program", "")
    return [journal, *(_recording(f) for f in by_format.values())]


def _recording(form: Format) -> tuple[str, ...]:
    """Return a row of a format, which the docstring of its module describes."""
    module = inspect.getmodule(form.write)
    assert module is not None
    meaning = (module.__doc__ or "").partition("\n")[0].rstrip(".")
    extra = f"{EXTRA} ({form.needs})" if form.needs else ""
    return ", ".join(map(code, form.endings)), text(meaning), extra

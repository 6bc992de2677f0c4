"""`index.md`: the list of the reference pages."""

from collections.abc import Mapping
from types import ModuleType

from build_time.reference.markdown import page, sentence, table

_HEAD = """\
Every key, option, effect, fault, object and field. These pages are generated from the declarations
of the package by `python docs/build_time/write_reference.py`."""

_WRITTEN = """\
Written by hand: [machines and valves](machines.md), [EDS files](eds_files.md), [Python](python.md)
and the [protocol](protocol.md) of control port and panel."""


def write(pages: Mapping[str, ModuleType]) -> str:
    """Return the page; the docstring of a page's module describes the page."""
    rows = [
        (f"[{name.replace('_', ' ')}]({name}.md)", _holds(module)) for name, module in pages.items()
    ]
    return page(
        "Reference",
        _HEAD,
        table(("page", "holds"), rows),
        _WRITTEN,
    )


def _holds(module: ModuleType) -> str:
    return sentence((module.__doc__ or "").partition(": ")[2])

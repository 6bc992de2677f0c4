"""The list of bench tests, and the function that performs them.

Each file of the folder `procedures` declares one bench test.
"""

import contextlib
import dataclasses
import functools
import importlib
import pkgutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from hil_emulator.characterise import procedures
from hil_emulator.characterise.page import page
from hil_emulator.characterise.procedure import Procedure
from hil_emulator.characterise.result import Agreement, BenchResult
from hil_emulator.characterise.size import of_documents
from hil_emulator.characterise.stand import Bench
from hil_emulator.characterise.writing import outputs, write_result
from hil_emulator.errors import UserError
from hil_emulator.model.effects.lines import pressure_compensator
from hil_emulator.model.equilibrium import NoEquilibriumError
from hil_emulator.model.rests_on import rests_on
from hil_emulator.platform.output_files import new_files, refuse_existing

LONGEST_STEP = 2e-5
"""Longest integration step of the tests [s]; a machine may need a shorter step."""


@functools.cache
def bench_tests() -> tuple[Procedure, ...]:
    """Return every bench test, in the order of the page."""
    names = (module.name for module in pkgutil.iter_modules(procedures.__path__))
    modules = [importlib.import_module(f"{procedures.__name__}.{name}") for name in names]
    tests: list[Procedure] = [module.TEST for module in modules]
    return tuple(sorted(tests, key=lambda test: (test.chapter, test.place)))


def chosen(names: Sequence[str]) -> tuple[Procedure, ...]:
    """Return the tests of these names in the page's order; "all" means every test.

    Raises:
        UserError: if a test is not known.

    """
    there = [test.name for test in bench_tests()]
    for name in names:
        if name != "all" and name not in there:
            raise UserError(
                f"there is no bench test '{name}'; there are: {', '.join(there)}, "
                "and 'all' for every one"
            )
    return tuple(test for test in bench_tests() if "all" in names or test.name in names)


def characterise(
    names: Sequence[str], bench: Bench, out: Path,
    progress: Callable[[str], None] = lambda text: None, *, overwrite: bool = False,
    moved: Mapping[str, float] = MappingProxyType({}),
) -> list[BenchResult]:  # fmt: skip
    """Perform bench tests on an emulated actuator and write the results.

    The tests command the coil: ramps, compensation, spool feedback and dither of a driver are off.
    They measure the spool without a pressure compensator, as a valve bench does.

    The files are a table (CSV), the result (JSON) and a picture (PNG) for each test, and
    `index.html` for all tests. They are written when all tests are done.

    Args:
        names: the tests, or "all".
        bench: the actuator; its integration step at most `LONGEST_STEP`.
        out: folder to write into; created if it is missing.
        progress: called with one line before each test.
        moved: defaults of the bench, each moved by its spread, by field; numbers that depend on a
            default are marked.
        overwrite: whether files of earlier results are replaced.

    Raises:
        UserError: if a test is not known, a file exists or cannot be written, or the machine has
            no equilibrium that any of the tests could start from.

    """
    tests = chosen(names)
    kept = {pressure_compensator.field_of(pressure_compensator.knob): pressure_compensator.off}
    bench = dataclasses.replace(bench, values={**bench.values, **bench.off("driver"), **kept})
    index = out / "index.html"
    every = [file for test in tests for file in outputs(test.name, out)]
    refuse_existing([index, *every], overwrite=overwrite)
    with new_files(overwrite=overwrite) as staged:
        file = staged(index)
        results = _performed(tests, bench, file.parent, progress, moved)
        file.write_text(page(results, file.parent), encoding="utf-8")
    return results


def _performed(
    tests: Sequence[Procedure],
    bench: Bench,
    folder: Path,
    progress: Callable[[str], None],
    moved: Mapping[str, float],
) -> list[BenchResult]:
    """Perform tests and write their results into a folder; leave out tests without equilibrium."""
    results, left_out = [], []
    for i, test in enumerate(tests, start=1):
        progress(f"{i}/{len(tests)}  {test.title}")
        try:
            result = _marked(_without_foreign_figures(test.run(bench), bench), bench, moved)
        except NoEquilibriumError as error:
            left_out.append(f"{test.name}: {error}")
            progress(f"     left out: {error}")
            continue
        write_result(result, test.draw, folder)
        results.append(result)
    if not results:
        raise UserError(f"no bench test could be performed: {'; '.join(left_out)}")
    return results


def _marked(result: BenchResult, bench: Bench, moved: Mapping[str, float]) -> BenchResult:
    """Return a result whose expected numbers name the defaults that they depend on."""
    if result.again is None:
        return result
    others = {}
    for field, value in moved.items():
        other = dataclasses.replace(bench, values={**bench.values, field: value})
        with contextlib.suppress(NoEquilibriumError, ValueError):
            others[field] = {c.quantity: c.expected for c in result.again(other)}
    fields = rests_on({c.quantity: c.expected for c in result.comparisons}, others)
    marked = [
        dataclasses.replace(c, rests_on=fields.get(c.quantity, ())) for c in result.comparisons
    ]
    return dataclasses.replace(result, comparisons=marked)


def _without_foreign_figures(result: BenchResult, bench: Bench) -> BenchResult:
    """Return a result; without the documents' figures if the bench is another machine."""
    if of_documents(bench):
        return result
    applicable = [c for c in result.comparisons if c.kind != Agreement.DOCUMENT]
    left_out = len(result.comparisons) - len(applicable)
    note = f"Left out: {left_out} figures of the documents, which are for another machine."
    notes = [*result.notes, note] if left_out else result.notes
    return dataclasses.replace(result, comparisons=applicable, notes=notes, figures=())

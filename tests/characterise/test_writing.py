"""What the bench tests leave behind in a folder."""

import csv
import json
import re
from collections.abc import Mapping
from pathlib import Path

import pytest

from hil_emulator.characterise.registry import bench_tests, characterise, chosen
from hil_emulator.characterise.result import Agreement, BenchResult, Comparison, grouped
from hil_emulator.characterise.stand import Bench
from hil_emulator.config.load import Configuration
from hil_emulator.errors import UserError
from hil_emulator.model.kernel import build

QUICK = ("bulk-modulus", "force-poles")


def at_bench(config: Configuration, cache: Path, values: Mapping[str, float], seed: int) -> Bench:
    """Return the reference machine's model with some values, at the test bench."""
    return Bench(build(config.effects, cache), values, config.sensors, seed)


@pytest.fixture(scope="module")
def folder(reference: Configuration, cache: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the files of two quick tests."""
    out = tmp_path_factory.mktemp("bench") / "made" / "by it"
    lines: list[str] = []
    results = characterise(QUICK, at_bench(reference, cache, reference.plant, 1), out, lines.append)
    assert [r.name for r in results] == list(QUICK)
    assert [line.split()[0] for line in lines] == ["1/2", "2/2"]
    return out


@pytest.mark.parametrize("name", QUICK)
def test_a_table_has_units_in_its_heading_and_numbers_below(folder: Path, name: str) -> None:
    """A spreadsheet opens the CSV: one heading line, then rows of numbers of the same length."""
    with (folder / f"{name}.csv").open(encoding="utf-8") as stream:
        heading, *rows = csv.reader(stream)
    assert all(re.fullmatch(r".+ \[.+\]", name) for name in heading)
    assert rows
    assert all(len([float(v) for v in row]) == len(heading) for row in rows)


@pytest.mark.parametrize("name", QUICK)
def test_json_holds_table_and_comparisons(folder: Path, name: str) -> None:
    """Strict JSON, without NaN, with the same numbers as the CSV."""

    def refuse(text: str) -> float:
        raise AssertionError(text)

    text = (folder / f"{name}.json").read_text("utf-8")
    content = json.loads(text, parse_constant=refuse)
    keys = {"quantity", "unit", "expected", "measured", "source"}
    assert content["comparisons"][0].keys() >= keys
    lengths = {len(column["values"]) for column in content["columns"].values()}
    with (folder / f"{name}.csv").open(encoding="utf-8") as stream:
        assert lengths == {len(list(csv.reader(stream))) - 1}


def test_the_page_needs_no_other_file(folder: Path) -> None:
    """Pictures are embedded; nothing is fetched; every comparison has its row."""
    page = (folder / "index.html").read_text("utf-8")
    sources = re.findall(r'(?:src|href)="([^"]{0,30})', page)
    assert all(s.startswith(("data:image/png;base64,", "#")) for s in sources)
    assert page.count("<img ") == len(QUICK)
    files = [json.loads((folder / f"{n}.json").read_text("utf-8")) for n in QUICK]
    rows = [c for file in files for c in file["comparisons"]]
    # a heading for each kind
    assert page.count("<tr>") == len(rows) + len({c["kind"] for c in rows})
    for figure in (f for file in files for f in file["figures"]):
        assert f"<b>{figure['name']}</b> states" in page
    for name in QUICK:
        assert (folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")


def test_a_difference_beyond_tolerance_is_called_so() -> None:
    """The verdict is about the relative difference, whatever the sign."""
    near = Comparison("zero", "rad/s", -30.0, "S1", -30.2, 0.01, Agreement.DOCUMENT)
    far = Comparison("zero", "rad/s", -30.0, "S1", -31.0, 0.01, Agreement.DOCUMENT)
    assert near.agrees
    assert not far.agrees
    assert far.difference == pytest.approx(1.0 / 30.0)
    assert not Comparison("x", "", 1.0, "", float("nan"), 0.01, Agreement.DERIVED).agrees


def test_agreement_is_counted_for_each_kind_alone() -> None:
    """Agreement with configured values does not compensate for a missed figure of a document."""
    rows = [
        Comparison("zero", "rad/s", -30.0, "S1", -40.0, 0.01, Agreement.DOCUMENT),
        *[Comparison("gain", "1", 1.0, "configured", 1.0, 0.01, Agreement.CONFIGURED)] * 9,
    ]
    groups = grouped([BenchResult("one", "", "", {}, rows)])
    assert [g.summary for g in groups] == [
        "the document's figure: 0 of 1", "configured, found again: 9 of 9",
    ]  # fmt: skip
    assert sum(len(g.rows) for g in groups) == len(rows)


def test_an_unknown_test_is_refused_with_the_known_ones() -> None:
    """The message lists what there is."""
    with pytest.raises(UserError, match="valve-flow, pressure-gain"):
        chosen(["valve-flux"])
    assert chosen(["all"]) == bench_tests()
    assert [t.name for t in chosen(["sensors", "valve-flow"])] == ["valve-flow", "sensors"]


def test_every_bench_test_has_a_place_of_its_own() -> None:
    """The page's order and the files' names are no matter of chance."""
    assert len({(test.chapter, test.place) for test in bench_tests()}) == len(bench_tests())
    assert len({test.name for test in bench_tests()}) == len(bench_tests())


def test_a_folder_that_cannot_be_written_is_said(
    reference: Configuration, cache: Path, tmp_path: Path
) -> None:
    """A file in the folder's place gives one message, not a traceback."""
    taken = tmp_path / "taken"
    taken.write_text("")
    with pytest.raises(UserError, match="cannot be written: Not a directory"):
        characterise(["force-poles"], at_bench(reference, cache, reference.plant, 1), taken)


def test_a_test_without_an_equilibrium_is_left_out_and_said(
    reference: Configuration, cache: Path, tmp_path: Path
) -> None:
    """A load that never rests stops the test that needs rest, not the others."""
    shaken = reference.plant | {"harmonic_force_amplitude": 100.0}
    lines: list[str] = []
    results = characterise(
        ["force-response", "bulk-modulus"],
        at_bench(reference, cache, shaken, 1),
        tmp_path,
        lines.append,
    )
    assert [r.name for r in results] == ["bulk-modulus"]
    assert any("left out" in line for line in lines)
    with pytest.raises(UserError, match="force-response: no equilibrium"):
        characterise(["force-response"], at_bench(reference, cache, shaken, 1), tmp_path / "two")
    assert not (tmp_path / "two").exists()


def test_the_seed_decides_the_noise(reference: Configuration, cache: Path, tmp_path: Path) -> None:
    """The same seed gives the same table, another one another."""

    def table(seed: int) -> str:
        bench = at_bench(reference, cache, reference.plant, seed)
        characterise(["sensors"], bench, tmp_path, overwrite=True)
        return (tmp_path / "sensors.csv").read_text("utf-8")

    first = table(1)
    assert table(1) == first
    assert table(2) != first


def test_a_number_that_rests_on_a_default_names_it(
    reference: Configuration, cache: Path, tmp_path: Path
) -> None:
    """Creeping flow rests on the oil's viscosity, turbulent flow at full opening does not."""
    bench = at_bench(reference, cache, reference.plant, 1)
    moved = {"oil_kinematic_viscosity": 2 * reference.plant["oil_kinematic_viscosity"]}
    (result,) = characterise(["discharge"], bench, tmp_path, moved=moved)
    marks = {c.quantity: c.rests_on for c in result.comparisons}
    assert marks["C_d at 2% opening and 0.1 bar"] == ("oil_kinematic_viscosity",)
    assert marks["turbulent discharge coefficient, full opening, 70 bar"] == ()
    content = json.loads((tmp_path / "discharge.json").read_text("utf-8"))
    assert ["oil_kinematic_viscosity"] in [c["rests_on_assumed"] for c in content["comparisons"]]
    assert "rests on an assumed oil_kinematic" in (tmp_path / "index.html").read_text("utf-8")

"""The files of a release agree: one version, one date, and a citation that tools can read."""

import datetime
import re
import tomllib
from pathlib import Path

import yaml

from hil_emulator import __version__

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text())
CHANGELOG = (ROOT / "docs" / "CHANGELOG.md").read_text()
GROUPS = ["Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"]
"""Headings that keepachangelog.com has for a version."""


def test_the_version_is_written_in_one_place() -> None:
    """The metadata of a wheel takes its version from the package."""
    assert PROJECT["project"]["dynamic"] == ["version"]
    file = ROOT / PROJECT["tool"]["hatch"]["version"]["path"]
    assert re.findall(r'^__version__ = "(.+)"$', file.read_text(), re.M) == [__version__]


def test_the_changelog_has_each_version_with_its_date_and_the_newest_first() -> None:
    """`Unreleased` stands above the versions; the first of these is the package's."""
    first, *versions = re.findall(r"^## (.+)$", CHANGELOG, re.M)
    assert first == "Unreleased"
    parts = [re.fullmatch(r"(\d+\.\d+\.\d+) - (\d{4}-\d\d-\d\d)", v).groups() for v in versions]
    dates = [datetime.date.fromisoformat(date) for _, date in parts]
    assert dates == sorted(dates, reverse=True)
    assert parts[0][0] == __version__


def test_the_changelog_has_the_groups_of_its_form() -> None:
    """A reader of other changelogs finds the headings that he knows."""
    assert set(re.findall(r"^### (.+)$", CHANGELOG, re.M)) <= set(GROUPS)


def test_the_citation_names_the_newest_version() -> None:
    """With the keys that CFF 1.2.0 demands, and version and date of the changelog."""
    assert CITATION["cff-version"] == "1.2.0"
    assert CITATION.keys() >= {"message", "title", "authors"}
    assert f"## {CITATION['version']} - {CITATION['date-released']}" in CHANGELOG
    assert CITATION["version"] == __version__

"""Output files appear whole or not at all, and never in place of others unasked."""

import os
from pathlib import Path

import pytest

from hil_emulator.errors import UserError
from hil_emulator.platform.output_files import new_files, refuse_existing, write_texts


def content(folder: Path) -> dict[str, str]:
    """Return the texts of a folder's files, hidden ones too, by name."""
    return {f.name: f.read_text() for f in sorted(folder.iterdir())}


def test_a_file_that_exists_is_kept(tmp_path: Path) -> None:
    """The message names it and the way out; the other file of the set is not written either."""
    (tmp_path / "b.txt").write_text("mine")
    with pytest.raises(UserError, match=r"b\.txt: exists already; .*--overwrite"):
        write_texts({tmp_path / "a.txt": "new", tmp_path / "b.txt": "new"})
    assert content(tmp_path) == {"b.txt": "mine"}


def test_a_file_is_replaced_on_request(tmp_path: Path) -> None:
    """Those that exist are replaced, the others are made."""
    (tmp_path / "b.txt").write_text("mine")
    write_texts({tmp_path / "a.txt": "new", tmp_path / "b.txt": "new"}, overwrite=True)
    assert content(tmp_path) == {"a.txt": "new", "b.txt": "new"}


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_failure_half_way_leaves_what_was_there(tmp_path: Path, *, overwrite: bool) -> None:
    """Neither a half file nor a new folder is left, and the old file is whole."""
    (tmp_path / "old.txt").write_text("mine")

    def fail() -> None:
        with new_files(overwrite=overwrite) as staged:
            with staged(tmp_path / "old.txt").open("w") as stream:
                stream.write("half")
                stream.flush()
            staged(tmp_path / "made" / "new.txt").write_text("whole")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert content(tmp_path) == {"old.txt": "mine"}


def test_a_file_that_appears_meanwhile_is_kept(tmp_path: Path) -> None:
    """What another program writes during the work is not lost, and the set stays whole."""
    first, second = tmp_path / "a.txt", tmp_path / "b.txt"

    def late() -> None:
        with new_files() as staged:
            staged(first).write_text("new")
            staged(second).write_text("new")
            second.write_text("other")

    with pytest.raises(UserError, match=r"b\.txt: exists already"):
        late()
    assert content(tmp_path) == {"b.txt": "other"}


def test_a_file_that_appears_in_the_last_moment_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between the last look and the move: the exclusive creation fails, and takes back the set."""
    first, second = tmp_path / "a.txt", tmp_path / "b.txt"
    move = os.replace

    def moved(source: Path, target: Path) -> None:
        move(source, target)
        second.write_text("other")

    monkeypatch.setattr(os, "replace", moved)
    with pytest.raises(UserError, match=r"b\.txt: cannot be written: File exists"):
        write_texts({first: "new", second: "new"})
    assert content(tmp_path) == {"b.txt": "other"}


@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize("target", ["there.txt", "missing.txt"])
def test_a_symbolic_link_is_not_followed(tmp_path: Path, target: str, *, overwrite: bool) -> None:
    """Whether its target exists or not, nothing appears outside the folder."""
    outside, inside = tmp_path / "outside", tmp_path / "inside"
    outside.mkdir()
    inside.mkdir()
    (outside / "there.txt").write_text("mine")
    link = inside / "link.txt"
    link.symlink_to(outside / target)
    with pytest.raises(UserError, match=r"link\.txt: is a symbolic link"):
        write_texts({link: "new"}, overwrite=overwrite)
    assert content(outside) == {"there.txt": "mine"}
    assert os.listdir(inside) == ["link.txt"]
    assert link.is_symlink()


def test_folders_and_devices_are_never_replaced(tmp_path: Path) -> None:
    """Not even on request: a device file would be gone for the whole machine."""
    os.mkfifo(tmp_path / "pipe")
    for file in (tmp_path, Path("/dev/null"), tmp_path / "pipe"):
        with pytest.raises(UserError, match="is not a regular file"):
            refuse_existing([file], overwrite=True)


def test_a_name_that_cannot_be_is_one_message(tmp_path: Path) -> None:
    """Longer than a file's name may be: a message, not a traceback."""
    with pytest.raises(UserError, match=r"cannot be written: File name too long"):
        write_texts({tmp_path / ("a" * 300): "new"})
    with pytest.raises(UserError, match=r"cannot be written: File name too long"):
        refuse_existing([tmp_path / ("a" * 300)])


def test_a_read_only_file_is_never_replaced(tmp_path: Path) -> None:
    """Its owner has protected it; that a file can be replaced in its folder is no permission."""
    file = tmp_path / "a.txt"
    file.write_text("mine")
    file.chmod(0o444)
    with pytest.raises(UserError, match="is read-only"):
        write_texts({file: "new"}, overwrite=True)
    assert content(tmp_path) == {"a.txt": "mine"}


def test_the_same_content_is_no_conflict(tmp_path: Path) -> None:
    """A file that several commands write alike, such as a schema, is left as it is."""
    file = tmp_path / "a.txt"
    file.write_text("same")
    before = file.stat().st_ino
    write_texts({file: "same", tmp_path / "b.txt": "new"})
    assert file.stat().st_ino == before
    assert content(tmp_path) == {"a.txt": "same", "b.txt": "new"}


def test_two_outputs_of_one_name_are_refused(tmp_path: Path) -> None:
    """The second would replace the first."""
    file = tmp_path / "a.txt"
    with pytest.raises(UserError, match="named for two outputs"):
        refuse_existing([file, file], overwrite=True)

    def twice() -> None:
        with new_files(overwrite=True) as staged:
            staged(file)
            staged(file)

    with pytest.raises(UserError, match="named for two outputs"):
        twice()


def test_what_comes_with_a_file_is_protected_too(tmp_path: Path) -> None:
    """A library that writes a second file next to the named one cannot replace another."""
    (tmp_path / "a.txt.index").write_text("mine")

    def with_index() -> None:
        with new_files() as staged:
            file = staged(tmp_path / "a.txt")
            file.write_text("new")
            file.with_name("a.txt.index").write_text("new")

    with pytest.raises(UserError, match=r"a\.txt\.index: exists already"):
        with_index()
    assert content(tmp_path) == {"a.txt.index": "mine"}


def test_a_place_that_cannot_be_written_is_one_message(tmp_path: Path) -> None:
    """A file in the place of a folder; other errors of the work stay what they are."""
    (tmp_path / "taken").write_text("mine")
    with pytest.raises(UserError, match=r"taken/a\.txt: cannot be written: Not a directory"):
        write_texts({tmp_path / "taken" / "a.txt": "new"})

    def elsewhere() -> None:
        with new_files() as staged:
            staged(tmp_path / "a.txt").write_text("new")
            Path("/not/there").read_text()

    with pytest.raises(FileNotFoundError, match="/not/there"):
        elsewhere()
    assert content(tmp_path) == {"taken": "mine"}

"""Files are whole or not there."""

import os
import stat

import pytest

from forestrl.storage import atomic_file, atomic_write


def test_text_is_written_as_utf_8(tmp_path):
    path = atomic_write(tmp_path / "a.txt", "ρ ≥ ρ*\n")
    assert path == tmp_path / "a.txt"
    assert path.read_bytes() == "ρ ≥ ρ*\n".encode()


def test_bytes_are_written_as_they_are(tmp_path):
    data = bytes(range(256)) * 1000
    assert atomic_write(str(tmp_path / "a.bin"), data).read_bytes() == data


def test_an_old_file_is_replaced(tmp_path):
    atomic_write(tmp_path / "a", "old and longer")
    atomic_write(tmp_path / "a", "new")
    assert (tmp_path / "a").read_text() == "new"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_others_may_read_it_as_any_file(tmp_path):
    (tmp_path / "plain").write_text("x")
    path = atomic_write(tmp_path / "a", "x")
    assert stat.S_IMODE(path.stat().st_mode) == stat.S_IMODE((tmp_path / "plain").stat().st_mode)


@pytest.mark.parametrize("moment", ["fsync", "replace"])
@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt()])
def test_an_interruption_leaves_the_old_file_and_no_part(tmp_path, monkeypatch, moment, error):
    path = atomic_write(tmp_path / "a", "old")

    def interrupted(*_):
        raise error

    monkeypatch.setattr(os, moment, interrupted)
    with pytest.raises(type(error)):
        atomic_write(path, "new")
    assert [file.name for file in tmp_path.iterdir()] == ["a"]
    assert path.read_text() == "old"


def test_a_missing_folder_is_an_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        atomic_write(tmp_path / "none" / "a", "x")


def test_a_file_written_in_pieces_appears_when_it_is_whole(tmp_path):
    (tmp_path / "a").write_text("old")
    with atomic_file(tmp_path / "a") as file:
        for piece in (b"new ", b"and ", b"longer"):
            file.write(piece)
            assert (tmp_path / "a").read_text() == "old"
    assert (tmp_path / "a").read_text() == "new and longer"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_a_file_whose_writing_breaks_off_leaves_no_part(tmp_path):
    with pytest.raises(KeyboardInterrupt), atomic_file(tmp_path / "a") as file:
        file.write(b"half")
        raise KeyboardInterrupt
    assert not list(tmp_path.iterdir())

import io
import zipfile
from pathlib import Path

import pytest

from app.archives import READ_BYTES, check_archive, entries_at_most
from r2c2r_core.errors import CaptureError

LIMITS = {"max_bytes": 1 << 20, "max_files": 100}


def write(path: Path, *members: tuple[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members:
            archive.writestr(name, content)
    return path


def test_too_many_bytes_or_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="GB allowed"):
        check_archive(write(tmp_path / "big.zip", ("a", bytes(2 << 20))), "it", **LIMITS)
    with pytest.raises(CaptureError, match="101 files"):
        check_archive(write(tmp_path / "many.zip", *((f"{n}", b"") for n in range(101))), "it", **LIMITS)


def test_archives_with_too_many_files_are_rejected_before_being_listed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def list_them(_: Path) -> None:
        raise AssertionError("each entry takes memory")

    names = [f"{number:0{length}}" for number, length in enumerate([3, 200] * 300)]  # signatures anywhere within a read chunk
    path = write(tmp_path / "many.zip", *((name, b"") for name in names))
    monkeypatch.setattr("app.archives.zipfile.ZipFile", list_them)
    with pytest.raises(CaptureError, match="600 files, at most 599"):
        check_archive(path, "it", max_bytes=1 << 20, max_files=599)
    with pytest.raises(AssertionError, match="each entry"):
        check_archive(path, "it", max_bytes=1 << 20, max_files=600)


@pytest.mark.parametrize("cut", range(5))  # bytes of the signature before the chunk's border; the rest is after it
def test_an_entry_signature_split_across_two_reads_is_counted_once(tmp_path: Path, cut: int) -> None:
    begins = "n" * (READ_BYTES - 46 - cut)  # the table's first entry takes 46 bytes and its name
    path = tmp_path / "cut.zip"
    table = b"".join(b"PK\x01\x02" + bytes(42) + name.encode() for name in (begins, "a", "b"))
    path.write_bytes(table)
    assert table[READ_BYTES - cut :].startswith(b"PK\x01\x02")
    assert entries_at_most(path, 0) == 3


def test_an_encrypted_archive_is_refused(tmp_path: Path) -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("a", b"b")
    content = bytearray(buffer.getvalue())
    content[content.rindex(b"PK\x01\x02") + 8] |= 1
    (tmp_path / "locked.zip").write_bytes(bytes(content))
    with pytest.raises(CaptureError, match="encrypted"):
        check_archive(tmp_path / "locked.zip", "it", **LIMITS)


def test_a_path_that_is_too_long_or_too_deep_is_refused(tmp_path: Path) -> None:
    for name, deep in enumerate(("n" * 1200, "d/" * 40 + "f")):
        with pytest.raises(CaptureError, match="folders"):
            check_archive(write(tmp_path / f"{name}.zip", (deep, b"x")), "it", **LIMITS)


def test_an_archive_with_duplicate_file_names_is_refused(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="Duplicate"):
        path = write(tmp_path / "twice.zip", ("a", b"1"), ("a", b"2"))
    with pytest.raises(CaptureError, match="two files named 'a'"):
        check_archive(path, "it", **LIMITS)

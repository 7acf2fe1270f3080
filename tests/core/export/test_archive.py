import os
import stat
import struct
import zipfile
from pathlib import Path

import pytest

from r2c2r_core.errors import BundleError
from r2c2r_core.export import archive
from r2c2r_core.export.archive import opened_bundle, unpack, write_zip


@pytest.fixture
def packed(good_folder: Path, tmp_path: Path) -> Path:
    write_zip(good_folder, tmp_path / "b.zip")
    return tmp_path / "b.zip"


def refused(path: Path) -> str:
    with pytest.raises(BundleError) as caught, opened_bundle(path):
        pass
    assert "\n" not in str(caught.value)
    assert path.name in str(caught.value)
    return str(caught.value)


def test_unpacking_a_zip_restores_identical_files(good_folder: Path, packed: Path, tmp_path: Path) -> None:
    unpack(packed, tmp_path / "out")
    for path in good_folder.rglob("*"):
        if path.is_file():
            assert (tmp_path / "out" / path.relative_to(good_folder)).read_bytes() == path.read_bytes()


def test_zip_bytes_do_not_depend_on_file_modification_times(good_folder: Path, packed: Path, tmp_path: Path) -> None:
    import os

    for number, path in enumerate(sorted(good_folder.rglob("*"), reverse=True)):
        os.utime(path, (1e9 + number, 1e9 + number))
    write_zip(good_folder, tmp_path / "again.zip")
    assert (tmp_path / "again.zip").read_bytes() == packed.read_bytes()


def test_a_zip_with_the_bundle_in_a_subfolder_is_accepted(good_folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "wrapped.zip"
    with zipfile.ZipFile(path, "w") as z:
        z.write(good_folder / "scene.urdf", "my_kitchen/scene.urdf")
    with opened_bundle(path) as folder:
        assert folder.name == "my_kitchen"


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_a_truncated_zip_is_rejected(packed: Path, share: float) -> None:
    packed.write_bytes(packed.read_bytes()[: int(share * packed.stat().st_size)])
    assert "not a readable zip" in refused(packed)


def test_a_zip_member_with_a_wrong_crc_is_rejected(packed: Path) -> None:
    content = bytearray(packed.read_bytes())
    with zipfile.ZipFile(packed) as z:
        member = z.getinfo("preview.png")  # stored uncompressed, so one byte stays one byte
    name_length, extra_length = struct.unpack("<HH", content[member.header_offset + 26 : member.header_offset + 30])
    content[member.header_offset + 30 + name_length + extra_length] ^= 0xFF
    packed.write_bytes(bytes(content))
    assert "CRC" in refused(packed)


@pytest.mark.parametrize(
    "name", ["../evil.txt", "/etc/evil.txt", "meshes/../../evil.txt", "C:\\evil.txt", "..\\evil.txt", "C:evil"]
)
def test_path_traversal_members_are_rejected_and_not_written(tmp_path: Path, name: str) -> None:
    path = tmp_path / "slip.zip"
    with zipfile.ZipFile(path, "w") as z:
        z.writestr("scene.urdf", "<robot/>")
        z.writestr(name, "evil")
    before = {p for p in tmp_path.parent.rglob("*evil*")}
    assert "leaves the bundle" in refused(path)
    assert {p for p in tmp_path.parent.rglob("*evil*")} == before


def test_a_symbolic_link_member_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "link.zip"
    entry = zipfile.ZipInfo("meshes")
    entry.create_system = 3
    entry.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(path, "w") as z:
        z.writestr(entry, "/etc")
    assert "leaves the bundle" in refused(path)


def test_duplicate_member_names_are_rejected_case_insensitively(tmp_path: Path) -> None:
    path = tmp_path / "twice.zip"
    with zipfile.ZipFile(path, "w") as z:
        z.writestr("scene.urdf", "<robot/>")
        z.writestr("Scene.urdf", "<robot/>")
    assert "twice" in refused(path)


def test_a_member_that_is_both_file_and_folder_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "both.zip"
    with zipfile.ZipFile(path, "w") as z:
        z.writestr("meshes", "a file")
        z.writestr("meshes/x.obj", "in it")
    assert "file and a folder" in refused(path)


def test_unpacked_size_and_member_count_are_limited(packed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archive, "MOST_BYTES", 1000)
    assert "when unpacked" in refused(packed)
    monkeypatch.setattr(archive, "MOST_MEMBERS", 3)
    assert "members" in refused(packed)


def test_files_that_are_not_bundles_are_rejected(tmp_path: Path) -> None:
    assert "no such file" in refused(tmp_path / "absent.zip")
    (tmp_path / "text.zip").write_text("hello")
    assert "not a readable zip" in refused(tmp_path / "text.zip")
    with zipfile.ZipFile(tmp_path / "other.zip", "w") as z:
        z.writestr("a.txt", "hello")
    assert "no scene.urdf" in refused(tmp_path / "other.zip")
    (tmp_path / "empty").mkdir()
    assert "no scene.urdf" in refused(tmp_path / "empty")


def test_an_encrypted_zip_is_rejected(packed: Path) -> None:
    content = bytearray(packed.read_bytes())
    for start in _signatures(content, b"PK\x01\x02"):
        content[start + 8] |= 1
    for start in _signatures(content, b"PK\x03\x04"):
        content[start + 6] |= 1
    packed.write_bytes(bytes(content))
    assert "encrypted" in refused(packed)


def _signatures(content: bytes, signature: bytes) -> list[int]:
    found, start = [], content.find(signature)
    while start >= 0:
        found.append(start)
        start = content.find(signature, start + 1)
    return found


def test_a_named_pipe_in_a_folder_is_rejected_without_blocking(good_folder: Path) -> None:
    material = next(good_folder.rglob("*.obj"))
    material.unlink()
    os.mkfifo(material)
    assert "a pipe" in refused(good_folder)

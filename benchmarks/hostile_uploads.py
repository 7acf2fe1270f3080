"""Uploads that mean harm or are broken: each must end in 4xx with one line, and leave nothing behind.

    python benchmarks/hostile_uploads.py [--count 1000] [--seed 0] [--json benchmarks/app-hostile.json]

A good recording (a tiny room as a .r3d) is damaged in every way listed in KINDS, each with its own random choices.
"""

import argparse
import io
import json
import random
import stat
import struct
import sys
import tarfile
import tempfile
import time
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import lzfse

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from app.jobs.plans import Commands
from tests.app.conftest import Running, running
from tests.core.ingest.tiny import TinyRoom, write_r3d

Members = dict[str, bytes]
Kind = Callable[[Members, random.Random], bytes]
NAMES = ("scan.r3d", "scan.zip", "../../etc/passwd", "a\nb.r3d", "<img src=x onerror=alert(1)>.zip", "\u202egpj.zip", "x" * 300)


def packed(members: Members, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """A zip of the members."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def bomb(good: Members, rng: random.Random) -> bytes:
    """A member that unpacks to hundreds of times its size."""
    size = rng.choice([66, 70, 80]) << 20
    return packed({**good, rng.choice(["metadata", "rgbd/0.jpg", "zeros"]): bytes(size)})


def overlapping_bomb(good: Members, rng: random.Random) -> bytes:
    """Many names in the table of contents, one body (a quoted-overlap bomb)."""
    body, check, name = *_zeros(), b"a"
    local = struct.pack("<4sHHHHHIIIHH", b"PK\3\4", 20, 0, 8, 0, 33, check, len(body), 1 << 24, 1, 0) + name + body
    entry = struct.pack(
        "<4sHHHHHHIIIHHHHHII",
        b"PK\1\2",
        20,
        20,
        0,
        8,
        0,
        33,
        check,
        len(body),
        1 << 24,
        2,
        0,
        0,
        0,
        0,
        0,
        0,
    )
    count = rng.randint(300, 900)
    table = b"".join(entry + struct.pack("<H", 0x3030 + n) for n in range(count))
    return local + table + struct.pack("<4sHHHHIIH", b"PK\5\6", 0, 0, count, count, len(table), len(local), 0)


@cache
def _zeros() -> tuple[bytes, int]:
    """16 MB of zeros, deflated, and their checksum."""
    content = bytes(1 << 24)
    return zlib.compress(content, 9)[2:-4], zlib.crc32(content)


def nested(good: Members, rng: random.Random) -> bytes:
    """Zips in zips."""
    content = packed(good)
    for depth in range(rng.randint(1, 5)):
        content = packed({f"{depth}.zip": content})
    return content


def traversal(good: Members, rng: random.Random) -> bytes:
    """A name that leads out."""
    names = [
        "../evil",
        "a/../../evil",
        "/etc/cron.d/evil",
        "..\\evil",
        "C:\\evil",
        "rgbd/../../../../tmp/evil",
        "\\\\host\\share\\x",
    ]
    return packed({**good, rng.choice(names): b"x"})


def link(good: Members, rng: random.Random) -> bytes:
    """A symbolic link or a device in the archive."""
    buffer = io.BytesIO(packed(good))
    info = zipfile.ZipInfo(rng.choice(["rgbd/0.jpg", "metadata", "secret"]) + "x")
    info.external_attr = (rng.choice([stat.S_IFLNK, stat.S_IFCHR, stat.S_IFIFO, stat.S_IFBLK]) | 0o777) << 16
    with zipfile.ZipFile(buffer, "a") as archive:
        archive.writestr(info, rng.choice(["/etc/passwd", "../../../r2c2r.db", "/dev/zero"]))
    return buffer.getvalue()


def truncated(good: Members, rng: random.Random) -> bytes:
    """Cut short somewhere."""
    content = packed(good)
    return content[: rng.randrange(1, len(content) - 30)]


def wrong_type(good: Members, rng: random.Random) -> bytes:
    """Something else altogether."""
    tar = io.BytesIO()
    with tarfile.open(fileobj=tar, mode="w:gz") as archive:
        archive.addfile(tarfile.TarInfo("metadata"), io.BytesIO())
    others = [
        b"%PDF-1.7\n" + rng.randbytes(500),
        b"\x89PNG\r\n\x1a\n" + rng.randbytes(500),
        b"\x7fELF" + rng.randbytes(500),
        b"#!/bin/sh\nrm -rf /\n",
        b"<html><script>alert(1)</script></html>",
        tar.getvalue(),
        good["rgbd/0.jpg"],
        rng.randbytes(rng.randint(1, 5000)),
        b"PK\3\4" + rng.randbytes(rng.randint(1, 5000)),
        b"PK\5\6" + bytes(18),
        packed({"[Content_Types].xml": b"<x/>", "word/document.xml": b"<w/>"}),
        packed({"readme.txt": rng.randbytes(40)}),
        packed({f"{n}.jpg": good["rgbd/0.jpg"] for n in range(3)}),
        b"",
    ]
    return rng.choice(others)


def poisoned_numbers(good: Members, rng: random.Random) -> bytes:
    """Calibration or poses that are no numbers."""
    metadata: dict[str, Any] = json.loads(good["metadata"])
    value = rng.choice([float("nan"), float("inf"), -float("inf"), 1e308, -1.0, 0.0, None, "1", [], {}, 10**400])
    where = rng.choice(["K", "w", "h", "poses", "all"])
    if where == "all":
        metadata = dict.fromkeys(metadata, value)
    elif where == "poses":
        metadata["poses"] = [[value] * 7 for _ in metadata["poses"]]
        if value in (0.0, -1.0, 1e308):  # legal numbers, impossible poses
            metadata["poses"] = [[0.0] * 7 for _ in metadata["poses"]]
    elif where == "K":
        metadata["K"] = [value] * 9
        metadata.pop("perFrameIntrinsicCoeffs", None)
    else:
        metadata[where] = value if value != 0.0 else -5
    if isinstance(value, int) and value > 10**300:
        sys.set_int_max_str_digits(0)
    return packed({**good, "metadata": json.dumps(metadata).encode()})


def poisoned_text(good: Members, rng: random.Random) -> bytes:
    """Metadata that no parser should follow."""
    texts = [
        b"[" * 100_000,
        b'{"a":' * 50_000 + b"1" + b"}" * 50_000,
        b"\xff\xfe" + rng.randbytes(100),
        b"{" + b'"w":' + b"9" * 5000 + b"}",
        b"null",
        b"[]",
        b'"metadata"',
        b"",
        json.dumps({"w": 96, "h": 128, "K": [1] * 100_000, "poses": [[0] * 7] * 10}).encode(),
        json.dumps({"w": 96, "h": 128, "K": [92, 0, 0, 0, 92, 0, 48, 64, 1], "poses": {"__class__": "x"}}).encode(),
        good["metadata"][: len(good["metadata"]) // 2],
    ]
    return packed({**good, "metadata": rng.choice(texts)})


def huge_images(good: Members, rng: random.Random) -> bytes:
    """Colour whose header claims more pixels than any memory holds, or pictures that are none."""
    jpeg = bytearray(good["rgbd/0.jpg"])
    at = jpeg.index(b"\xff\xc0")
    jpeg[at + 5 : at + 9] = b"\xff\xff\xff\xff"
    png = (
        b"\x89PNG\r\n\x1a\n" + b"\0\0\0\rIHDR" + struct.pack(">II", 2**31 - 1, 2**31 - 1) + b"\x08\x02\0\0\0" + rng.randbytes(8)
    )
    others = [bytes(jpeg), png, rng.randbytes(300), b"", b"<svg xmlns='http://www.w3.org/2000/svg'/>", good["rgbd/0.jpg"][:200]]
    chosen = rng.choice(others)
    return packed({name: chosen if name.endswith(".jpg") else content for name, content in good.items()})


def huge_depth(good: Members, rng: random.Random) -> bytes:
    """Depth that is cut, random, of another size, or a bomb in LZFSE."""
    some = next(content for name, content in good.items() if name.endswith(".depth"))
    others = [
        some[: len(some) // 2],
        rng.randbytes(400),
        lzfse.compress(bytes(64 << 20)),
        lzfse.compress(b"\0" * 7),
        b"bvx2" + b"\xff" * 60,
        b"bvx-" + struct.pack("<I", 2**32 - 1) + b"x" * 50,
        b"",
    ]
    chosen = rng.choice(others)
    return packed({name: chosen if name.endswith(".depth") else content for name, content in good.items()})


def lying_table(good: Members, rng: random.Random) -> bytes:
    """A table of contents that does not tell the truth."""
    content = bytearray(packed(good))
    choice = rng.randrange(5)
    first = content.index(b"PK\1\2")
    if choice == 0:
        content[first + 8] |= 1  # encrypted
    elif choice == 1:
        at = first
        while (at := content.find(b"PK\1\2", at)) >= 0:
            struct.pack_into("<H", content, at + 10, rng.choice([12345, 99, 6]))  # a method nobody knows
            at += 4
    elif choice == 2:
        at = first
        while (at := content.find(b"PK\1\2", at)) >= 0:
            struct.pack_into("<I", content, at + 42, rng.randrange(2**31))  # bodies elsewhere
            at += 4
    elif choice == 3:
        end = content.rindex(b"PK\5\6")
        struct.pack_into("<I", content, end + 12, 0xFFFFFFF0)  # a table of 4 GB
    else:
        at = first
        while (at := content.find(b"PK\1\2", at)) >= 0:
            struct.pack_into("<I", content, at + 24, 0x70000000)  # 1.8 GB each
            at += 4
    return bytes(content)


def damaged_bodies(good: Members, rng: random.Random) -> bytes:
    """Every body of the archive has wrong bytes in it."""
    content = bytearray(packed(good, zipfile.ZIP_STORED))
    for info in zipfile.ZipFile(io.BytesIO(bytes(content))).infolist():
        at = info.header_offset + 30 + len(info.filename) + rng.randrange(max(info.file_size, 1))
        content[at] ^= 0xFF
    return bytes(content)


def stripped(good: Members, rng: random.Random) -> bytes:
    """A part that is needed is missing."""
    part = rng.choice(["metadata", ".jpg", ".depth", "rgbd"])
    return packed({name: content for name, content in good.items() if part not in name})


KINDS: tuple[Kind, ...] = (
    bomb, overlapping_bomb, nested, traversal, link, truncated, wrong_type, poisoned_numbers, poisoned_text,
    huge_images, huge_depth, lying_table, damaged_bodies, stripped,
)  # fmt: skip


def good_members(folder: Path) -> Members:
    """A recording that is read without complaint."""
    path = write_r3d(folder / "good.r3d", replace(TinyRoom(), count=4))
    with zipfile.ZipFile(path) as archive:
        return {info.filename: archive.read(info) for info in archive.infolist() if not info.is_dir()}


def send_all(folder: Path, count: int, seed: int) -> dict[str, Any]:
    """Send `count` of them to an app of its own; what was wrong, and how long it took."""
    rng = random.Random(seed)
    good = good_members(folder)
    statuses, wrong, slowest, by_kind = Counter[int](), [], 0.0, Counter[str]()
    began = time.monotonic()
    with running(folder / "data", commands=Commands(), run_jobs=False) as web:
        assert upload(web, packed(good), "good.r3d").status_code == 202, "the undamaged recording is taken"
        for project in web.get("/api/projects"):
            web.delete(f"/api/projects/{project['id']}")
        for number in range(count):
            kind = KINDS[number % len(KINDS)]
            content = kind(good, rng)
            sent = time.monotonic()
            answer = upload(web, content, rng.choice(NAMES))
            slowest = max(slowest, time.monotonic() - sent)
            statuses[answer.status_code] += 1
            by_kind[kind.__name__] += 1
            problem = complaint(web, answer)
            if problem:
                wrong.append(f"{kind.__name__} ({number}): {problem}")
    return {
        "count": count,
        "kinds": dict(by_kind),
        "statuses": {str(status): many for status, many in sorted(statuses.items())},
        "wrong": wrong,
        "slowest_s": round(slowest, 2),
        "seconds": round(time.monotonic() - began, 1),
    }


def upload(web: Running, content: bytes, name: str) -> Any:
    """One upload, in one piece."""
    return web.client.post("/api/projects/upload", params={"filename": name}, content=content)


def complaint(web: Running, answer: Any) -> str:
    """What is wrong with an answer to a hostile upload; empty when nothing is."""
    if not 400 <= answer.status_code < 500:
        return f"{answer.status_code}: {answer.text[:200]}"
    said = answer.json()
    if set(said) != {"kind", "message", "hint", "current"}:
        return f"not an error's shape: {answer.text[:200]}"
    words = f"{said['message']} {said['hint']}"
    if any(ord(sign) < 32 for sign in words) or len(words) > 1000:
        return f"not one line: {words[:200]!r}"
    if str(web.settings.data_dir) in words or "Traceback" in words:
        return f"tells what it should not: {words[:200]}"
    data = web.settings.data_dir
    left = [path for place in ("projects", "uploads") for path in (data / place).rglob("*") if path.is_file()]
    if left or web.get("/api/projects") or web.get("/api/uploads"):
        return f"left behind: {left[:3]}"
    return ""


def main() -> int:
    """Send, report; 1 when something was wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="r2c2r-hostile-") as folder:
        figures = send_all(Path(folder), options.count, options.seed)
    text = json.dumps(figures, indent=1)
    print(text)
    if options.json:
        options.json.write_text(text + "\n")
    return 1 if figures["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())

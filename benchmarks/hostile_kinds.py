"""Generators of broken or malicious recordings, each with random choices of its own."""

import io
import json
import random
import stat
import struct
import sys
import tarfile
import warnings
import zipfile
import zlib
from collections.abc import Callable
from functools import cache
from typing import Any

import lzfse
import numpy as np

Members = dict[str, bytes]
Kind = Callable[[Members, random.Random], bytes]


def packed(members: Members, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """A zip of the members."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def bomb(good: Members, rng: random.Random) -> bytes:
    """A decompression bomb: a member that unpacks to hundreds of times its size."""
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
    """A member name that leads out of the target folder (path traversal)."""
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
    """A symbolic link or a device file in the archive."""
    buffer = io.BytesIO(packed(good))
    info = zipfile.ZipInfo(rng.choice(["rgbd/0.jpg", "metadata", "secret"]) + "x")
    info.external_attr = (rng.choice([stat.S_IFLNK, stat.S_IFCHR, stat.S_IFIFO, stat.S_IFBLK]) | 0o777) << 16
    with zipfile.ZipFile(buffer, "a") as archive:
        archive.writestr(info, rng.choice(["/etc/passwd", "../../../r2c2r.db", "/dev/zero"]))
    return buffer.getvalue()


def truncated(good: Members, rng: random.Random) -> bytes:
    """An archive cut short at a random place."""
    content = packed(good)
    return content[: rng.randrange(1, len(content) - 30)]


def wrong_type(good: Members, rng: random.Random) -> bytes:
    """A file of a different type."""
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
    """Calibration or poses with invalid numbers."""
    metadata: dict[str, Any] = json.loads(good["metadata"])
    value = rng.choice([float("nan"), float("inf"), -float("inf"), 1e308, -1.0, 0.0, None, "1", [], {}, 10**400])
    where = rng.choice(["K", "w", "h", "poses", "all"])
    if where == "all":
        metadata = dict.fromkeys(metadata, value)
    elif where == "poses":
        metadata["poses"] = [[value] * 7 for _ in metadata["poses"]]
        if value in (0.0, -1.0, 1e308):  # valid numbers, impossible poses
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
    """Metadata that no parser should process."""
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
    """Colour images whose header claims more pixels than any memory can hold, or invalid pictures."""
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
    """Depth that is cut short, random, of another size, or an LZFSE bomb."""
    some = next(content for name, content in good.items() if name.endswith(".depth"))
    others = [
        some[: len(some) // 2],
        rng.randbytes(400),
        _depth_bomb(),
        lzfse.compress(b"\0" * 7),
        b"bvx2" + b"\xff" * 60,
        b"bvx-" + struct.pack("<I", 2**32 - 1) + b"x" * 50,
        b"",
    ]
    chosen = rng.choice(others)
    return packed({name: chosen if name.endswith(".depth") else content for name, content in good.items()})


@cache
def _depth_bomb() -> bytes:
    """64 MB of zeros in 48 kB of LZFSE, as blocks of 1 MB: compressing them in one block takes half a minute."""
    return 64 * lzfse.compress(bytes(1 << 20))[:-4] + b"bvx$"


def lying_table(good: Members, rng: random.Random) -> bytes:
    """An archive with a false table of contents."""
    content = bytearray(packed(good))
    choice = rng.randrange(5)
    first = content.index(b"PK\1\2")
    if choice == 0:
        content[first + 8] |= 1  # encrypted
    elif choice == 1:
        at = first
        while (at := content.find(b"PK\1\2", at)) >= 0:
            struct.pack_into("<H", content, at + 10, rng.choice([12345, 99, 6]))  # an unknown compression method
            at += 4
    elif choice == 2:
        at = first
        while (at := content.find(b"PK\1\2", at)) >= 0:
            struct.pack_into("<I", content, at + 42, rng.randrange(2**31))  # wrong offsets of the bodies
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
    """Wrong bytes in every body of the archive."""
    content = bytearray(packed(good, zipfile.ZIP_STORED))
    for info in zipfile.ZipFile(io.BytesIO(bytes(content))).infolist():
        at = info.header_offset + 30 + len(info.filename) + rng.randrange(max(info.file_size, 1))
        content[at] ^= 0xFF
    return bytes(content)


def stripped(good: Members, rng: random.Random) -> bytes:
    """An archive that lacks its metadata, colour or depth."""
    part = rng.choice(["metadata", ".jpg", ".depth", "rgbd"])
    return packed({name: content for name, content in good.items() if part not in name})


def nothing_measured(good: Members, rng: random.Random) -> bytes:
    """No valid depth anywhere: NaN, infinite, zero or negative."""
    value = rng.choice([float("nan"), float("inf"), -float("inf"), -1.0, 0.0])
    size = next(len(lzfse.decompress(content)) for name, content in good.items() if name.endswith(".depth"))
    depth = lzfse.compress(np.full(size // 4, value, "<f4").tobytes())
    return packed({name: depth if name.endswith(".depth") else content for name, content in good.items()})


def huge_headers(good: Members, rng: random.Random) -> bytes:
    """Many names, comments and extra fields as long as the format allows."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for number in range(rng.randint(30, 60)):
            info = zipfile.ZipInfo(f"{number}{'n' * rng.randint(5_000, 60_000)}")
            info.comment, info.extra = b"c" * 65_000, b"\xfe\xca" + struct.pack("<H", 60_000) + bytes(60_000)
            archive.writestr(info, b"")
        for name, content in good.items():
            archive.writestr(name, content)
        archive.comment = b"z" * 65_000
    return buffer.getvalue()


def deep_folders(good: Members, rng: random.Random) -> bytes:
    """Folders nested hundreds deep."""
    deep = "d/" * rng.randint(40, 10_000)
    where = rng.choice(["beside", "around"])
    inner = {**good, deep + "f": b"x"} if where == "beside" else {deep + name: content for name, content in good.items()}
    return packed(inner)


def many_files(good: Members, rng: random.Random) -> bytes:
    """Many more files than any recording has, all empty."""
    count = rng.choice([200_001, 260_000])
    local = struct.pack("<4sHHHHHIIIHH", b"PK\3\4", 20, 0, 0, 0, 33, 0, 0, 0, 6, 0) + b"000000"
    return local + _empty_files(count) + struct.pack("<4sHHHHIIH", b"PK\5\6", 0, 0, 0xFFFF, 0xFFFF, 52 * count, len(local), 0)


@cache
def _empty_files(count: int) -> bytes:
    """A zip of `count` empty files."""
    entry = struct.pack("<4sHHHHHHIIIHHHHHII", b"PK\1\2", 20, 20, 0, 0, 0, 33, 0, 0, 0, 6, 0, 0, 0, 0, 0, 0)
    return b"".join(entry + b"%06d" % number for number in range(count))


def twice_the_same_name(good: Members, rng: random.Random) -> bytes:
    """Two files with one name: an ambiguous archive."""
    buffer = io.BytesIO(packed(good))
    with zipfile.ZipFile(buffer, "a") as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Python warns of exactly that
        archive.writestr(rng.choice(list(good)), rng.randbytes(rng.randint(1, 300)))
    return buffer.getvalue()


def names_of_no_encoding(good: Members, rng: random.Random) -> bytes:
    """Names flagged as UTF-8 that are not valid UTF-8."""
    content = bytearray(packed(good))
    for mark, flags, name in ((b"PK\1\2", 8, 46), (b"PK\3\4", 6, 30)):
        at = -1
        while (at := content.find(mark, at + 1)) >= 0:
            content[at + flags + 1] |= 0x08
            content[at + name] = rng.choice([0xFF, 0xC0, 0x80])
    return bytes(content)


KINDS: tuple[Kind, ...] = (
    bomb, overlapping_bomb, nested, traversal, link, truncated, wrong_type, poisoned_numbers, poisoned_text,
    huge_images, huge_depth, lying_table, damaged_bodies, stripped, nothing_measured, huge_headers, deep_folders,
    many_files, twice_the_same_name, names_of_no_encoding,
)  # fmt: skip

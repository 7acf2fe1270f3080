"""LZFSE decompression with the unpacked size checked beforehand, so that a small file cannot exhaust memory.

A stream is a run of blocks, each with its magic and its unpacked size (little-endian uint32); `bvx$` ends it
(lzfse_internal.h).
"""

import struct

from r2c2r_core.ingest.readers.protocol import UnreadableFrame

_END = b"bvx$"
_BLOCKS = (b"bvx2", b"bvxn", b"bvx-")


def unpacked_size(content: bytes, name: str) -> int:
    """Unpacked size of `content` in bytes; its own length if it is not LZFSE. Raises UnreadableFrame when it is cut off."""
    if content[:4] not in (*_BLOCKS, _END):
        return len(content)  # some writers store it raw
    total, at = 0, 0
    try:
        while (magic := content[at : at + 4]) != _END:
            if magic not in _BLOCKS:
                raise UnreadableFrame(f"{name}: damaged LZFSE data at byte {at} of {len(content)}")
            total += struct.unpack_from("<I", content, at + 4)[0]
            at += _block_length(magic, content, at)
    except struct.error as problem:
        raise UnreadableFrame(f"{name}: damaged LZFSE data, cut off after {len(content)} bytes") from problem
    return total


def unpacked(content: bytes, name: str) -> bytes:
    """The unpacked data; the content itself if it is not LZFSE. Check `unpacked_size` first."""
    import lzfse

    if content[:4] not in _BLOCKS:
        return content
    try:
        return bytes(lzfse.decompress(content))
    except (lzfse.error, MemoryError) as problem:  # garbage in LZVN ends as the latter
        raise UnreadableFrame(f"{name}: damaged LZFSE data ({len(content)} bytes)") from problem


def _block_length(magic: bytes, content: bytes, at: int) -> int:
    if magic == b"bvx-":  # plain bytes
        return 8 + int(struct.unpack_from("<I", content, at + 4)[0])
    if magic == b"bvxn":  # LZVN: magic, unpacked size, payload size
        return 12 + int(struct.unpack_from("<I", content, at + 8)[0])
    literals, matches, header = struct.unpack_from("<QQQ", content, at + 8)  # bit fields of the version 2 header
    return (header & 0xFFFFFFFF) + (literals >> 20 & 0xFFFFF) + (matches >> 40 & 0xFFFFF)

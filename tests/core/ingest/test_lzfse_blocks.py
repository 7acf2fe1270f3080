"""Unpacked size, known before unpacking."""

import lzfse
import numpy as np
import pytest

from r2c2r_core.ingest.readers.lzfse_blocks import unpacked, unpacked_size
from r2c2r_core.ingest.readers.protocol import UnreadableFrame


@pytest.mark.parametrize("count", [0, 1, 5, 100, 5_000, 196_608, 3_000_000])
@pytest.mark.parametrize("kind", ["zeros", "noise", "smooth"])
def test_the_computed_size_matches_the_decompressed_data(count, kind):
    rng = np.random.default_rng(0)
    values = {
        "zeros": np.zeros(count, np.uint8),
        "noise": rng.integers(0, 256, count).astype(np.uint8),
        "smooth": (np.arange(count) // 7 % 251).astype(np.uint8),
    }
    raw = values[kind].tobytes()
    packed = lzfse.compress(raw)
    assert unpacked_size(packed, "x") == count
    assert count == 0 or unpacked(packed, "x") == raw


def test_truncated_lzfse_data_raises():
    packed = lzfse.compress(np.random.default_rng(0).integers(0, 9, 100_000).astype(np.uint8).tobytes())
    with pytest.raises(UnreadableFrame, match="damaged LZFSE"):
        unpacked_size(packed[: len(packed) // 2], "x")


def test_uncompressed_data_is_returned_unchanged():
    assert unpacked_size(b"1234567", "x") == 7
    assert unpacked(b"1234567", "x") == b"1234567"

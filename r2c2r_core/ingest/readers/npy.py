"""Depth stored as a NumPy array, as nerfstudio and older versions of Stray Scanner write it."""

import io
from tokenize import TokenError

import numpy as np

from r2c2r_core.ingest.readers.protocol import UnreadableFrame

SUFFIX = ".npy"


def read_array(content: bytes, name: str, max_pixels: int) -> np.ndarray:
    """A (h, w) numeric array from a .npy file, with its size checked before loading; raises UnreadableFrame."""
    stream = io.BytesIO(content)
    try:
        version = np.lib.format.read_magic(stream)
        read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = read_header(stream)
        if len(shape) == 3 and shape[2] == 1:
            shape = shape[:2]
        if len(shape) != 2 or min(shape) < 1 or shape[0] * shape[1] > max_pixels or dtype.kind not in "fiu":
            raise ValueError(f"{dtype} of shape {shape}")
        return np.load(io.BytesIO(content), allow_pickle=False).reshape(shape)
    # the header is a Python literal, and numpy does not catch the errors of its parser
    except (
        ValueError,
        EOFError,
        OSError,
        SyntaxError,
        TypeError,
        KeyError,
        MemoryError,
        RecursionError,
        TokenError,
    ) as problem:
        raise UnreadableFrame(f"{name}: not a readable depth array ({problem})") from problem

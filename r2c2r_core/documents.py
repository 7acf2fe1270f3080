"""Strict JSON reader for untrusted documents: bounded size, regular files, unambiguous values, one-line errors.

JSON leaves the meaning of repeated keys, NaN, lone surrogates or numbers of 5,000 digits open, and unbounded nesting crashes
Python's parser; all of these are refused before anything is computed from them (RFC 8259, sections 4-9).
"""

import json
import math
import os
import re
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from r2c2r_core.errors import InputError

MOST_BYTES = 64 * 2**20  # an hour of poses is half of it
MOST_DEEP = 64  # the deepest of our own formats has 8
_LONGEST_NUMBER = 40  # characters; 17 digits distinguish every double
_STRINGS = re.compile(rb'"[^"\\]*+(?:\\.?[^"\\]*+)*+(?:"|\Z)', re.DOTALL)  # possessive, and the last may lack its end: linear


def read_json(path: Path, failure: type[InputError] = InputError, *, hint: str) -> Any:
    """The document in a regular file of UTF-8 JSON; raises `failure`, whose next step is `hint`."""
    return parse_json(read_bounded(path, failure, hint=hint), str(path), failure, hint=hint)


def read_bounded(path: Path, failure: type[InputError] = InputError, *, hint: str) -> bytes:
    """The content of a regular file of at most 64 MiB; a pipe would block, a device never ends. Raises `failure`."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError as error:
        raise failure(f"{path}: no such file", hint=hint) from error
    except OSError as error:
        raise failure(f"{path}: cannot be read ({error.strerror})", hint=hint) from error
    except ValueError as error:  # a NUL in its name
        raise failure(f"{str(path)!r}: not a valid path ({error})", hint=hint) from error
    try:
        found = os.fstat(descriptor)
        if not stat.S_ISREG(found.st_mode):
            raise failure(f"{path}: {kind_of_file(found.st_mode)}, expected a file", hint=hint)
        if found.st_size > MOST_BYTES:
            raise failure(f"{path}: {found.st_size >> 20} MiB, expected at most {MOST_BYTES >> 20} MiB", hint=hint)
        with os.fdopen(os.dup(descriptor), "rb") as stream:
            return stream.read(MOST_BYTES + 1)
    except OSError as error:
        raise failure(f"{path}: cannot be read ({error.strerror})", hint=hint) from error
    finally:
        os.close(descriptor)


def parse_json(
    content: bytes | str, where: str, failure: type[InputError] = InputError, *, hint: str, lenient: bool = False
) -> Any:
    """The parsed JSON document; `where` names it. Raises `failure`.

    `lenient`, for recordings of other apps: NaN and infinities are kept (lost tracking), the last of a repeated key counts,
    and whole numbers of any length become floats.
    """

    def refuse(found: str) -> InputError:
        return failure(f"{where}: not usable JSON: {found}", hint=hint)

    if isinstance(content, str):
        content = content.encode("utf-8", errors="surrogatepass")
    if len(content) > MOST_BYTES:
        raise refuse(f"more than {MOST_BYTES >> 20} MiB")
    if _depth(content) > MOST_DEEP:
        raise refuse(f"nested more than {MOST_DEEP} deep")
    rules = {"parse_int": float} if lenient else _strict_rules()
    try:
        text = content.decode("utf-8-sig")
        document = json.loads(text, **rules)
        if "\\u" in text:
            _encodable(document)
    except UnicodeDecodeError as error:
        raise refuse(f"byte {error.start} is not UTF-8") from error
    except UnicodeEncodeError as error:
        raise refuse("half of a surrogate pair, which is not a character") from error
    except json.JSONDecodeError as error:
        raise refuse(f"line {error.lineno}, column {error.colno}: {error.msg}") from error
    except _Refused as error:
        raise refuse(str(error)) from error
    return document


def kind_of_file(mode: int) -> str:
    """Kind of a file in words, from its mode."""
    kinds: tuple[tuple[Callable[[int], bool], str], ...] = (
        (stat.S_ISREG, "a file"),
        (stat.S_ISDIR, "a folder"),
        (stat.S_ISFIFO, "a pipe"),
        (stat.S_ISSOCK, "a socket"),
    )
    return next((name for is_kind, name in kinds if is_kind(mode)), "a device")


class _Refused(Exception):  # not a ValueError: those are the parser's own
    """A value that JSON allows but this reader does not."""


def _strict_rules() -> dict[str, Any]:
    return {
        "parse_int": _whole,
        "parse_float": _finite,
        "parse_constant": _no_constant,
        "object_pairs_hook": _distinct,
    }


def _whole(text: str) -> int:
    if len(text) > _LONGEST_NUMBER:
        raise _Refused(f"a number of {len(text)} digits, {text[:12]}…")
    return int(text)


def _finite(text: str) -> float:
    number = float(text)
    if len(text) > _LONGEST_NUMBER or not math.isfinite(number):
        raise _Refused(f"the number {text[:12]}{'…' if len(text) > 12 else ''}, too long or too large")
    return number


def _no_constant(text: str) -> float:
    raise _Refused(f"{text}, expected a number")


def _distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise _Refused(f"the key '{twice[:40]}' appears twice in one object")
    return found


def _encodable(document: Any) -> None:
    """Raise UnicodeEncodeError for text that cannot be encoded."""
    json.dumps(document, ensure_ascii=False).encode()


def _depth(content: bytes) -> int:
    """Nesting depth of brackets outside of strings."""
    if content.count(b"[") + content.count(b"{") <= MOST_DEEP:
        return 0
    bare = np.frombuffer(_STRINGS.sub(b"", content), np.uint8)
    opened = np.isin(bare, np.frombuffer(b"[{", np.uint8)).astype(np.int32)
    closed = np.isin(bare, np.frombuffer(b"]}", np.uint8)).astype(np.int32)
    return int(np.cumsum(opened - closed).max(initial=0))

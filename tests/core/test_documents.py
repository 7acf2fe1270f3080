import json
import os
import threading
from pathlib import Path

import pytest

from r2c2r_core.documents import parse_json, read_json
from r2c2r_core.errors import InputError
from tests.waiting import PATIENCE_S

HINT = "give a file of settings"


def parse(content: bytes, *, lenient: bool = False) -> object:
    return parse_json(content, "x.json", hint=HINT, lenient=lenient)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"[" * 100_000 + b"]" * 100_000, "nested more than 64 deep"),
        (b'{"a":' * 70_000 + b"1" + b"}" * 70_000, "nested more than 64 deep"),
        (b"[" + b"9" * 5000 + b"]", "a number of 5000 digits"),
        (b"[1e400]", "the number 1e400"),
        (b"[0." + b"1" * 5000 + b"]", "the number 0.1"),
        (b"[NaN]", "NaN"),
        (b"[-Infinity]", "-Infinity"),
        (b'{"a": 1, "b": 2, "a": 3}', "the key 'a' appears twice"),
        (rb'["\ud800"]', "surrogate"),
        (b'["\xff"]', "byte 2 is not UTF-8"),
        (b"", "line 1, column 1"),
        (b'{"a": 1', "line 1"),
    ],
)
def test_invalid_json_is_rejected_with_a_one_line_error(content: bytes, says: str) -> None:
    with pytest.raises(InputError, match=says) as caught:
        parse(content)
    assert str(caught.value).startswith("x.json: ")
    assert str(caught.value).endswith(HINT)
    assert "\n" not in str(caught.value)


def test_brackets_in_strings_do_not_count_as_nesting() -> None:
    text = "[{" * 500 + '\\"' + "[" * 500
    assert parse(json.dumps({"a": [text]}).encode()) == {"a": [text]}


def test_a_surrogate_pair_is_decoded_as_one_character() -> None:
    assert parse(rb'["\ud83d\ude00"]') == ["\U0001f600"]


def test_lenient_parsing_accepts_nan_and_duplicate_keys() -> None:
    found = parse(b'{"a": [NaN, -Infinity, ' + b"9" * 400 + b'], "b": 1, "b": 2}', lenient=True)
    assert isinstance(found, dict)
    assert found["b"] == 2.0
    assert str(found["a"]) == "[nan, -inf, inf]"


def test_an_unterminated_string_is_rejected_in_linear_time() -> None:
    with pytest.raises(InputError):
        parse(b"[" * 65 + b'"' + rb"\"" * 300_000)  # a pattern with quadratic time would take minutes


def test_a_named_pipe_is_rejected_without_blocking(tmp_path: Path) -> None:
    pipe = tmp_path / "prompts.json"
    os.mkfifo(pipe)
    done = threading.Event()

    def read() -> None:
        with pytest.raises(InputError, match="a pipe, expected a file"):
            read_json(pipe, hint=HINT)
        done.set()

    threading.Thread(target=read, daemon=True).start()
    assert done.wait(PATIENCE_S)


@pytest.mark.parametrize(("name", "says"), [(".", "a folder, expected a file"), ("a", "no such file"), ("n" * 300, "too long")])
def test_a_path_that_is_not_a_file_is_rejected(tmp_path: Path, name: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        read_json(tmp_path / name, hint=HINT)


def test_device_files_are_rejected() -> None:
    with pytest.raises(InputError, match="a device, expected a file"):
        read_json(Path("/dev/zero"), hint=HINT)


def test_a_byte_order_mark_is_ignored(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_bytes(b"\xef\xbb\xbf[1, 2.5]")
    assert read_json(path, hint=HINT) == [1, 2.5]

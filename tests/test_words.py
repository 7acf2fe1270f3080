"""Words that confused users appear on no page."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
STOPPED = [
    "fixture table",
    "its handle a block",
    "what nobody saw of it",
    "fits alike",
    "Held to",
    "proportions 1 :",
    "cutting furniture runs",
    "Who draws",
    "Who makes",
    "off once fitted",
    "and accepts, corrects",
    "Why all the same",
    "Password, from",
    '"Boxes"',
    '"Disagreement"',
    "fronts cut on an",
    "of the generator served",
    "by fit to both",
    "% of the longest`",
    "no other one fits",
    "only outlines constrain",
    "warned of in",
    "Least travel reached",
    '"Not here"',
]


@pytest.mark.parametrize("words", STOPPED)
def test_words_that_confused_users_are_not_used(words: str) -> None:
    pages = [*(ROOT / "static" / "js").rglob("*.js"), *(ROOT / "static").glob("*.html")]
    code = [path for room in ("app", "r2c2r_core") for path in (ROOT / room).rglob("*.py")]
    said = [path for path in (*pages, *code) if any(words in text for text in quoted(path.read_text(encoding="utf-8")))]
    assert said == []


def quoted(text: str) -> list[str]:
    """Lines with a quoted text: docstrings may use any word."""
    return [line for line in text.splitlines() if '"' in line or "`" in line]

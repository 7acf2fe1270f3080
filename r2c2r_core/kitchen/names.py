"""Parsing of typed names to categories.

A name is matched regardless of case, separators, plural and a trailing number ("Micro-wave Ovens 2"). Otherwise by its head,
the last word of an English compound, and every other word of a name: "white two-door base cabinet" is a two-door cabinet. For a
category that is built as a fixture the remaining words may only describe position or look: a "dish rack" is no shelf unit and a
"car door" no cabinet, while any "... bottle" is a bottle.
"""

import difflib
import re
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

from r2c2r_core.kitchen import categories
from r2c2r_core.kitchen.category import Category

_PLACES_AND_LOOKS = frozenset(
    (
        *("kitchen", "left", "right", "top", "bottom", "middle", "center", "centre", "upper", "lower", "corner", "base"),
        *(
            "first",
            "second",
            "third",
            "last",
            "main",
            "single",
            "small",
            "large",
            "big",
            "wide",
            "narrow",
            "tall",
            "low",
            "high",
        ),
        *(
            "white",
            "black",
            "grey",
            "gray",
            "brown",
            "red",
            "green",
            "blue",
            "wooden",
            "wood",
            "oak",
            "metal",
            "steel",
            "glass",
        ),
        *("old", "new", "open", "built", "in", "integrated", "free", "standing", "freestanding", "electric", "gas", "the", "a"),
    )
)
_PLURALS = (("s", ""), ("es", ""), ("ves", "f"), ("ies", "y"))
_ALIKE = 0.7  # minimum difflib ratio of a suggested name
_SUGGESTED = 3


class Named(NamedTuple):
    """The category of a typed name, and a notice if the table does not know it."""

    category: Category
    notice: str | None


class _Table(NamedTuple):
    """Index of the category table by words."""

    whole: dict[str, Category]  # by a name without its separators
    by_head: dict[str, list[tuple[frozenset[str], Category]]]  # by the last word of a name, with all its words
    words: frozenset[str]


def category_of(text: str) -> Category:
    """The category of a typed name; the rigid, free-standing `object` for an unknown one."""
    return named(text).category


def named(text: str) -> Named:
    """The category of a typed name, with a suggestion of close names for an unknown one."""
    return _named(text, categories.every_category())


@lru_cache(maxsize=512)
def _named(text: str, lines: tuple[Category, ...]) -> Named:
    table = _table(lines)
    typed = _words(text)
    words = [_singular(word, table.words) for word in typed]
    for said in (typed, words):
        found = table.whole.get("".join(said)) or _by_head(said, table)
        if found is not None:
            return Named(found, None)
    spoken = [name.replace("_", " ") for category in lines for name in category.names]
    close = difflib.get_close_matches(" ".join(words), spoken, n=_SUGGESTED, cutoff=_ALIKE)
    advice = f"; did you mean {' or '.join(close)}?" if close else ""
    notice = f"{text!r} is not a known category: it is built as a rigid, free-standing object{advice}"
    return Named(table.whole["object"], notice)


@lru_cache(maxsize=4)
def _table(lines: tuple[Category, ...]) -> _Table:
    whole: dict[str, Category] = {}
    by_head: dict[str, list[tuple[frozenset[str], Category]]] = {}
    for category in lines:
        for name in category.names:
            words = name.split("_")
            whole["".join(words)] = category
            by_head.setdefault(words[-1], []).append((frozenset(words), category))
    return _Table(whole, by_head, frozenset(word for entries in by_head.values() for words, _ in entries for word in words))


def _by_head(words: Sequence[str], table: _Table) -> Category | None:
    """The longest name with the same last word whose other words were all typed; the part before "of" is the head."""
    said = words[: words.index("of")] if "of" in words else words
    if not said:
        return None
    fitting = [entry for entry in table.by_head.get(said[-1], []) if entry[0] <= set(said)]
    if not fitting:
        return None
    name, category = max(fitting, key=lambda entry: len(entry[0]))
    return category if category.fixture is None or set(said) - name <= _PLACES_AND_LOOKS else None


def _words(text: str) -> list[str]:
    """Words in lower case, without a number at the end."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text).casefold()
    words = re.findall(r"[^\W\d_]+|\d+", re.sub(r"[\W\d_]+$", "", spaced))
    return ["two" if word == "2" else word for word in words]


def _singular(word: str, known: frozenset[str]) -> str:
    """The singular of the word, where the table knows that; else the word."""
    forms = (re.sub(ending + "$", stem, word) for ending, stem in _PLURALS if word.endswith(ending))
    return next((form for form in forms if form in known), word)

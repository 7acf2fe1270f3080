"""Tables for a spreadsheet program: CSV whose text stays text."""

import csv
import io
from collections.abc import Iterable


def written(head: list[str], rows: Iterable[list[str]]) -> str:
    """The table; text that a spreadsheet would run as a formula is quoted."""
    out = io.StringIO()
    lines = csv.writer(out, lineterminator="\n")
    lines.writerow(head)
    lines.writerows([_plain(text) for text in row] for row in rows)
    return out.getvalue()


def _plain(text: str) -> str:
    """As text in a spreadsheet, whatever it begins with."""
    return f"'{text}" if text[:1] in ("=", "+", "-", "@", "\t", "\r") else text

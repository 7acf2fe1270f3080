"""CSV export that is safe against formula injection in spreadsheets."""

import csv
import io
from collections.abc import Iterable


def written(head: list[str], rows: Iterable[list[str]]) -> str:
    """The CSV table, with text that a spreadsheet would run as a formula escaped."""
    out = io.StringIO()
    lines = csv.writer(out, lineterminator="\n")
    lines.writerow(head)
    lines.writerows([_plain(text) for text in row] for row in rows)
    return out.getvalue()


def _plain(text: str) -> str:
    """The text escaped if it starts like a formula."""
    return f"'{text}" if text[:1] in ("=", "+", "-", "@", "\t", "\r") else text

"""Text of others: what in it a terminal, a page or a file name would obey instead of show.

Control characters (C0 without tab and new line, C1), overrides of the writing direction (bidirectional embeddings,
overrides and isolates: Unicode TR 9, 2.1-2.5) and lone surrogates, which no file or database can hold.
"""

import re

OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


def shown(text: str) -> str:
    """The text with the code of each such character in its place."""
    return OBEYED.sub(lambda found: f"\\u{ord(found.group()):04x}", text)

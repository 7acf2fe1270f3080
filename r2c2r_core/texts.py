"""Text of others: what in it a terminal, a page or a file name would obey instead of show.

Control characters (C0 without tab and new line, C1), overrides of the writing direction (bidirectional embeddings,
overrides and isolates: Unicode TR 9, 2.1-2.5) and lone surrogates, which no file or database can hold.
"""

import re

OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
"""A name that every format takes: USD prims, and Isaac's importers, refuse a leading digit, the others any other character."""


DEVICE = re.compile("(?i:con|prn|aux|nul|com[0-9]|lpt[0-9])")
"""What Windows keeps for devices: it unpacks no folder of that name, and an object's files lie in one of its own."""


def name_fault(text: str) -> str:
    """What keeps an object from being called that in every format and file system, after "it"; empty: nothing."""
    if DEVICE.fullmatch(text):
        return "is a device of Windows, which unpacks no folder of that name"
    if text[:1].isdecimal():
        return "begins with a digit: USD and Isaac's importers refuse it"
    return "" if IDENTIFIER.fullmatch(text) else "holds more than letters, digits and underscores: simulators accept no more"


def identifier(text: str) -> str:
    """An object's name made of a text; "object" where nothing of it can stay."""
    plain = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_") or "object"
    return f"item_{plain}" if name_fault(plain) else plain


def shown(text: str) -> str:
    """The text with the code of each such character in its place."""
    return OBEYED.sub(lambda found: f"\\u{ord(found.group()):04x}", text)

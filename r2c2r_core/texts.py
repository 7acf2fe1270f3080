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


def is_object_name(text: str) -> bool:
    """Whether an object may be called that in every format and file system."""
    return IDENTIFIER.fullmatch(text) is not None and DEVICE.fullmatch(text) is None


def identifier(text: str) -> str:
    """An object's name made of a text; "object" where nothing of it can stay."""
    plain = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_") or "object"
    return plain if is_object_name(plain) else f"item_{plain}"


def shown(text: str) -> str:
    """The text with the code of each such character in its place."""
    return OBEYED.sub(lambda found: f"\\u{ord(found.group()):04x}", text)

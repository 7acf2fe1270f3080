"""Sanitising of untrusted text: escaping of control characters, and valid object names.

Escaped are control characters (C0 without tab and new line, C1), bidirectional controls (embeddings, overrides and
isolates: Unicode TR 9, 2.1-2.5) and lone surrogates, which no file or database can store.
"""

import re

OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
"""A name valid in every format: USD prims and Isaac's importers refuse a leading digit, the others any other character."""


DEVICE = re.compile("(?i:con|prn|aux|nul|com[0-9]|lpt[0-9])")
"""Device names reserved by Windows, which unpacks no folder of that name, while each object's files lie in its own folder."""


def name_fault(text: str) -> str:
    """Reason why an object's name is invalid in some format or file system, as a phrase after "it"; empty if it is valid."""
    if DEVICE.fullmatch(text):
        return "is a device name on Windows, which cannot unpack a folder of that name"
    if text[:1].isdecimal():
        return "begins with a digit: USD and Isaac's importers refuse it"
    return "" if IDENTIFIER.fullmatch(text) else "contains characters that simulators refuse: use letters, digits and _"


def identifier(text: str) -> str:
    """A valid object name made from a text; "object" where no character remains."""
    plain = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_") or "object"
    return f"item_{plain}" if name_fault(plain) else plain


def shown(text: str) -> str:
    """The text with each such character replaced by its escaped code."""
    return OBEYED.sub(lambda found: f"\\u{ord(found.group()):04x}", text)


def fault_of(error: Exception) -> str:
    """Reason of a failed read as a phrase; a KeyError's own text is only the key."""
    return f"{error} is missing" if isinstance(error, KeyError) else str(error)

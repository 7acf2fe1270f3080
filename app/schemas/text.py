"""User-supplied text: bounded, stripped, and without control characters."""

from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, StringConstraints

from r2c2r_core.texts import OBEYED

LONGEST_FILE_NAME = 255  # bytes: the limit of file systems
LONGEST_WORD = 60  # characters


def readable(value: Any) -> Any:
    """The given value; ValueError for text that cannot be displayed (r2c2r_core/texts.py)."""
    found = OBEYED.search(value) if isinstance(value, str) else None
    if found is not None:
        raise ValueError(f"it holds the character U+{ord(found.group()):04X}, which cannot be shown; remove it")
    return value


def one_line(value: Any) -> Any:
    """Readable text with each run of white space as one space."""
    return " ".join(readable(value).split()) if isinstance(value, str) else value


def lines(value: Any) -> Any:
    """Readable text without white space around it."""
    return readable(value.replace("\r\n", "\n")).strip() if isinstance(value, str) else value


def short_enough(text: str) -> str:
    """The text itself; ValueError where it is too long for a file name."""
    if len(text.encode()) > LONGEST_FILE_NAME:
        raise ValueError(f"it is longer than {LONGEST_FILE_NAME} bytes; choose one of the object's candidates")
    return text


Word = Annotated[
    str, BeforeValidator(one_line), StringConstraints(min_length=1, max_length=LONGEST_WORD)
]  # an object, a user …
Title = Annotated[str, BeforeValidator(one_line), StringConstraints(min_length=1, max_length=120)]  # of a project
Remark = Annotated[str, BeforeValidator(one_line), StringConstraints(max_length=1000)]  # a reason, possibly empty
Prose = Annotated[str, BeforeValidator(lines), StringConstraints(min_length=1, max_length=2000)]  # of several lines
FileName = Annotated[str, BeforeValidator(one_line), StringConstraints(min_length=1, max_length=300)]
ServerPath = Annotated[str, BeforeValidator(readable), StringConstraints(min_length=1, max_length=4096)]
Reference = Annotated[  # id of a candidate, or an uploaded mesh
    str, BeforeValidator(one_line), StringConstraints(min_length=1, max_length=LONGEST_FILE_NAME), AfterValidator(short_enough)
]

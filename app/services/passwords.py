"""Refusal of weak passwords, which attackers try first. Pure functions.

Length matters most (NIST SP 800-63B, 5.1.1.2: no composition rules, but a list of common passwords and of those derived from
the account).
"""

import re

from r2c2r_core.errors import InputError

SHORTEST = 10
LONGEST = 1000
FEWEST_CHARACTERS = 4  # different ones
FEWEST_OWN_LETTERS = 4  # besides the account's name or a common word
_ROWS = ("0123456789", "abcdefghijklmnopqrstuvwxyz", "qwertyuiop", "qwertzuiop", "asdfghjkl", "1qaz2wsx3edc4rfv5tgb6yhn7ujm")
_COMMON = (
    *("password", "passwort", "passwd", "qwerty", "qwertz", "letmein", "welcome", "willkommen", "iloveyou", "admin"),
    *("administrator", "changeme", "secret", "default", "login", "abc", "monkey", "dragon", "football", "baseball", "sunshine"),
    *("princess", "master", "superman", "trustno", "hello", "hallo", "test", "guest", "root", "kitchen", "rcr"),
)
_READ_AS = str.maketrans("013457@$!", "oieastasi")  # digits and symbols substituted for letters
_AT_THE_END = "0123456789!$.#*?-_"  # usual suffixes
_HINT = f"at least {SHORTEST} characters that are hard to guess, such as three unrelated words"


def refuse_weak(name: str, password: str) -> None:
    """Raise InputError, with the reason, for a weak password of the account."""
    reason = weakness(name.casefold(), password)
    if reason:
        raise InputError(f"the password {reason}", hint=_HINT)


def weakness(name: str, password: str) -> str:
    """Weakness of a password of the account `name`; empty without any."""
    folded = password.casefold()
    if not SHORTEST <= len(password) <= LONGEST:
        return f"has {len(password)} characters"
    if len(set(folded)) == 1:
        return "is one character over and over"
    if len(set(folded)) < FEWEST_CHARACTERS:
        return f"has only {len(set(folded))} different characters"
    if any(_in_order(folded, row) for row in _ROWS):
        return "is characters in order"
    own = re.sub(r"[\W\d_]", "", name)
    if own and own in _letters(folded) and len(_letters(folded).replace(own, "")) < FEWEST_OWN_LETTERS:
        return "is little more than the account's own name"
    readings = (folded, folded.translate(_READ_AS), folded.rstrip(_AT_THE_END).translate(_READ_AS))
    if any(_made_of_common_words(_letters(reading)) for reading in readings):
        return "is one of the commonest"
    return ""


def _in_order(text: str, row: str) -> bool:
    """Whether the text follows the row cyclically, forwards or backwards."""
    round_and_round = row * (len(text) // len(row) + 2)
    return text in round_and_round or text[::-1] in round_and_round


def _letters(text: str) -> str:
    return re.sub(r"[\W\d_]", "", text)


def _made_of_common_words(letters: str) -> bool:
    return re.fullmatch(rf"(?:{'|'.join(_COMMON)})+", letters) is not None

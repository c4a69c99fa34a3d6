"""Text from vehicles and users: what cannot be seen, or changes how the rest is shown, is removed or refused.

ESC sequences clear a terminal, bidirectional overrides turn a line around, and a line break forges a line of the log.
The joiners U+200C and U+200D are letters' business in many languages, and stay.
"""

from __future__ import annotations

import re
from typing import Final

_UNSEEN: Final = (
    r"\x7f-\x9f\xad\u034f\u061c\u115f\u1160\u180e\u200b\u200e\u200f"
    r"\u2028-\u202e\u2060-\u206f\u3164\ufeff\uffa0\ufff9-\ufffb"
)
UNSEEN_IN_LINE: Final = rf"\x00-\x1f{_UNSEEN}"
UNSEEN_IN_LINES: Final = rf"\x00-\x08\x0b-\x1f{_UNSEEN}"
"""Of a regular expression's character class; the second leaves line breaks and tabs."""
UNSEEN_TAGS: Final = "\U000e0000-\U000e007f"
"""Of a character class, too. Not of a JSON Schema's: readers there disagree about characters beyond U+FFFF."""
_NO_TEXT: Final = r"\ud800-\udfff"
_ESCAPES: Final = re.compile(r"(\x1b\[|\x9b)[0-?]*[ -/]*[@-~]|(\x1b\]|\x9d)[^\x07\x1b\x9c]*(\x07|\x1b\\|\x9c)?|\x1b.?")
_BREAKS: Final = re.compile(r"[\t-\r\x85\u2028\u2029]+")


def one_line(text: str) -> str:
    """The text as one line that can be shown anywhere: escapes and control characters removed, breaks are spaces."""
    return re.sub(f"[{UNSEEN_IN_LINE}{UNSEEN_TAGS}{_NO_TEXT}]", "", _BREAKS.sub(" ", _ESCAPES.sub("", text)))


def lines(text: str) -> str:
    """As one_line, with its line breaks and tabs."""
    return re.sub(f"[{UNSEEN_IN_LINES}{UNSEEN_TAGS}{_NO_TEXT}]", "", _ESCAPES.sub("", text))


def escaped(text: str) -> str:
    """JSON text whose strings show what cannot be seen as JSON's \\u escapes."""
    return re.sub(f"[{UNSEEN_IN_LINES}{_NO_TEXT}]", lambda found: f"\\u{ord(found[0]):04x}", text)

"""Text from vehicles and users neither steers a terminal, nor turns a line around, nor looks like another line."""

from __future__ import annotations

import json
import re
from typing import Annotated

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from app.domain.text import escaped, lines, one_line
from app.domain.validation.plain_text import PLAIN_LINE, PLAIN_TEXT

LINE: TypeAdapter[str] = TypeAdapter(Annotated[str, PLAIN_LINE])
TEXT: TypeAdapter[str] = TypeAdapter(Annotated[str, PLAIN_TEXT])


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b[2J\x1b[HAll is well", "All is well"),
        ("\x1b]0;title\x07Low battery", "Low battery"),
        ("\x1b]8;;http://x\x1b\\here\x1b]8;;\x1b\\", "here"),
        ("\x9b31mred\x9b0m", "red"),
        ("one\r\ntwo\tthree", "one two three"),
        ("gate \u202eevil\u202c", "gate evil"),
        ("soft\u00adhyphen, tag\U000e0041, filler\u3164", "softhyphen, tag, filler"),
        ("\u2066left\u2069 zero\u200bwidth\ufeff", "left zerowidth"),
        ("broken\ud800 \x00 text", "broken  text"),
        ("Grüße, 你好, می‌خواهم 👩‍🚀", "Grüße, 你好, می‌خواهم 👩‍🚀"),
    ],
)
def test_one_line_is_what_can_be_seen(text: str, shown: str) -> None:
    assert one_line(text) == shown


def test_lines_keep_their_breaks() -> None:
    assert lines("one\n\ttwo\x1b[2J\r") == "one\n\ttwo"


@given(st.text(alphabet=st.characters(), max_size=30))
def test_what_is_cleaned_is_a_plain_line(text: str) -> None:
    LINE.validate_python(one_line(text))
    assert one_line(one_line(text)) == one_line(text)


@pytest.mark.parametrize("text", ["a\nb", "\x1b[2J", "\u202etxt", "\u200b", "\x7f", "\x00"])
def test_names_with_such_characters_are_refused(text: str) -> None:
    with pytest.raises(ValidationError, match=r"control characters or invisible formatting, as U\+"):
        LINE.validate_python(text)


def test_notes_may_have_several_lines() -> None:
    assert TEXT.validate_python("ring twice\n\tat the gate") == "ring twice\n\tat the gate"
    with pytest.raises(ValidationError):
        TEXT.validate_python("ring\r")


@pytest.mark.parametrize("kind", [LINE, TEXT])
@given(text=st.text(max_size=10))
def test_the_schema_says_the_same_as_the_check(kind: TypeAdapter[str], text: str) -> None:
    pattern = kind.json_schema()["pattern"]
    try:
        kind.validate_python(text)
        is_taken = True
    except ValidationError:
        is_taken = False
    assert bool(re.fullmatch(pattern[1:-1], text)) is is_taken


def test_json_shows_what_cannot_be_seen() -> None:
    text = json.dumps({"text": "a\u202eb\x9b2J"}, ensure_ascii=False)
    assert escaped(text) == '{"text": "a\\u202eb\\u009b2J"}'
    assert json.loads(escaped(text)) == {"text": "a\u202eb\x9b2J"}

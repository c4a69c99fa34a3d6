"""What is wrong in a sentence, and how to mend it: pydantic speaks to those who wrote the model, these words do not."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from difflib import get_close_matches
from typing import Any, Final

from app.domain.validation.fault import Fault
from app.domain.validation.places import Path

MAX_SHOWN_CHARS: Final = 40
MAX_LISTED: Final = 12
_QUOTE: Final = "'"
_LARGE: Final = 10**20
_BOUNDS: Final[Mapping[str, tuple[str, str]]] = {
    "greater_than": ("more than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
}
_LENGTHS: Final[Mapping[str, tuple[str, str, str]]] = {
    "string_too_short": ("at least", "min_length", "character"),
    "string_too_long": ("at most", "max_length", "character"),
    "too_short": ("at least", "min_length", "entry"),
    "too_long": ("at most", "max_length", "entry"),
}


def message_of(fault: Fault, value: Any, *, noun: str) -> str:
    """The sentence. `value` is what stands at the fault's place, `noun` what a field is called in such a document."""
    name, context = name_of(fault.place.path), fault.context
    match fault.kind:
        case "missing":
            return f"{name} is missing" if _is_entry(fault.place.path) else f"the {noun} {name} is missing"
        case "extra_forbidden":
            return f"unknown {noun} {name}"
        case "union_tag_not_found":
            return f"the {noun} {context['discriminator']} is missing"
        case "union_tag_invalid":
            tag, known = _quoted(str(context["tag"])), ", ".join(fault.place.tags) or context["expected_tags"]
            return f"there is no {str(context['discriminator']).strip(_QUOTE)} {tag}; known: {known}"
        case "literal_error" | "enum":
            return f"{name} must be {_as_json(str(context['expected']))}, not {_shown(value)}"
        case "string_pattern_mismatch":
            return f"{name} must match {context['pattern']}, and {_shown(value)} does not"
        case "json_invalid":
            return f"this is not JSON: {_plain(str(context['error']))}"
        case kind if kind in _BOUNDS:
            words, bound = _BOUNDS[kind]
            return f"{name} must be {words} {_number(context[bound])}, not {_shown(value).strip(_QUOTE)}"
        case kind if kind in _LENGTHS:
            return f"{name} must {_length(*_LENGTHS[kind], context)}"
    if fault.wanted:
        return f"{name} must be {' or '.join(fault.wanted)}, not {_shown(value)}"
    said = fault.sentence.removeprefix("Value error, ").removeprefix("Assertion failed, ")
    return said.replace("Input should be", f"{name} must be").replace("Input should", f"{name} must")


def hint_of(fault: Fault, around: Any) -> str:
    """How to mend it, empty if the sentence says it. `around` is the object that the fault's place is in."""
    match fault.kind:
        case "extra_forbidden":
            present = around if isinstance(around, Collection) else ()
            left = [field for field in fault.place.fields if field not in present]
            return _near(str(fault.place.path[-1]), left) or _known(left)
        case "union_tag_invalid":
            return _near(str(fault.context["tag"]), fault.place.tags)
        case "union_tag_not_found":
            return f"known: {', '.join(fault.place.tags)}"
        case "missing" if fault.instead:
            return f"or give {' and '.join(fault.instead)} instead"
    return ""


def near_name(given: str, known: Collection[str]) -> str | None:
    """The known name that was probably meant."""
    return next(iter(get_close_matches(given, known, n=1)), None) if len(given) <= MAX_SHOWN_CHARS else None


def name_of(path: Path) -> str:
    """How a sentence calls a place: by its last key, with the indexes behind it."""
    if not path:
        return "the document"
    last = max((index for index, part in enumerate(path) if isinstance(part, str)), default=0)
    return _quoted(str(path[last]) + "".join(f"[{part}]" for part in path[last + 1 :]))


def _is_entry(path: Path) -> bool:
    return bool(path) and isinstance(path[-1], int)


def _near(given: str, known: Collection[str]) -> str:
    near = near_name(given, known)
    return f"did you mean {near!r}?" if near else ""


def _known(left: Collection[str]) -> str:
    return f"take it away; known here: {', '.join(left)}" if 0 < len(left) <= MAX_LISTED else "take it away"


def _length(words: str, bound: str, unit: str, context: Mapping[str, Any]) -> str:
    count = int(context[bound])
    if words == "at least" and count == 1:
        return "not be empty"
    many = {"entry": "entries", "character": "characters"}[unit]
    return f"have {words} {count} {unit if count == 1 else many}"


def _plain(parser: str) -> str:
    """What the JSON parser says, for people."""
    said = parser.replace("EOF while parsing", "it ends in the middle of")
    return said.replace("recursion limit exceeded", "it is nested too deep")


def _as_json(expected: str) -> str:
    """pydantic lists what it expects as Python writes it."""
    return {"True": "true", "False": "false", "None": "null"}.get(expected, expected)


def _shown(value: Any) -> str:
    match value:
        case None:
            return "null"
        case bool():
            return "true" if value else "false"
        case int() | float():
            return _number(value)
        case str():
            return _quoted(value)
        case Mapping():
            return "an object"
        case _:
            return "a list"


def _number(value: float) -> str:
    """As JSON writes it; a whole number without a point, one with hundreds of digits not at all."""
    if isinstance(value, float):
        if not math.isfinite(value):
            return "infinity" if math.isinf(value) else "NaN"
        return str(int(value)) if value == int(value) and abs(value) < _LARGE else repr(value)
    return str(value) if abs(value) < _LARGE else "so large a number"


def _quoted(text: str) -> str:
    return repr(text if len(text) <= MAX_SHOWN_CHARS else text[:MAX_SHOWN_CHARS] + "…")

"""Converts a pydantic error to findings: clear messages, JSON Pointers, and only the relevant branch of a union."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from typing import Any, Final

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails, from_json

from app.domain.validation.finding import Finding, Severity, json_pointer
from app.domain.validation.places import WANTED, Fault, Path, Places, places_of

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
    """Return the message. `value` is at the location, `noun` is the word for a field in this kind of document."""
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
            return f"unknown {str(context['discriminator']).strip(_QUOTE)} {tag}; known values: {known}"
        case "literal_error" | "enum":
            return f"{name} must be {_as_json(str(context['expected']))}, not {_shown(value)}"
        case "string_pattern_mismatch":
            return f"{name} must match {context['pattern']}; {_shown(value)} does not"
        case "unprintable":
            return f"{name} {fault.sentence}"
        case "json_invalid":
            return f"invalid JSON: {_plain(str(context['error']))}"
        case kind if kind in _BOUNDS:
            words, bound = _BOUNDS[kind]
            return f"{name} must be {words} {_number(context[bound])}, not {_shown(value).strip(_QUOTE)}"
        case kind if kind in _LENGTHS:
            return f"{name} must {_length(*_LENGTHS[kind], context)}"
        case _:
            pass
    if fault.wanted:
        return f"{name} must be {' or '.join(fault.wanted)}, not {_shown(value)}"
    said = fault.sentence.removeprefix("Value error, ").removeprefix("Assertion failed, ")
    return said.replace("Input should be", f"{name} must be").replace("Input should", f"{name} must")


def hint_of(fault: Fault, around: Any) -> str:
    """Return the hint, empty if the message is sufficient. `around` is the object that contains the location."""
    match fault.kind:
        case "extra_forbidden":
            present = around if isinstance(around, Collection) else ()
            left = [field for field in fault.place.fields if field not in present]
            return _near(str(fault.place.path[-1]), left) or _known(left)
        case "union_tag_invalid":
            return _near(str(fault.context["tag"]), fault.place.tags)
        case "union_tag_not_found":
            return f"known values: {', '.join(fault.place.tags)}"
        case "missing" if fault.instead:
            return f"or specify {' and '.join(fault.instead)} instead"
    return str(fault.context.get("hint", ""))


def near_name(given: str, known: Collection[str]) -> str | None:
    """Return the known name that was probably intended."""
    return next(iter(get_close_matches(given, known, n=1)), None) if len(given) <= MAX_SHOWN_CHARS else None


def name_of(path: Path) -> str:
    """Return the name of a location for a message: its last key and the indexes after it."""
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
    return f"remove it; known fields: {', '.join(left)}" if 0 < len(left) <= MAX_LISTED else "remove it"


def _length(words: str, bound: str, unit: str, context: Mapping[str, Any]) -> str:
    count = int(context[bound])
    if words == "at least" and count == 1:
        return "not be empty"
    many = {"entry": "entries", "character": "characters"}[unit]
    return f"have {words} {count} {unit if count == 1 else many}"


def _plain(parser: str) -> str:
    """Reword an error of the JSON parser."""
    said = parser.replace("EOF while parsing", "it ends in the middle of")
    return said.replace("recursion limit exceeded", "it is nested too deeply")


def _as_json(expected: str) -> str:
    """Reword a list of expected values, which pydantic formats as Python."""
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
    """Format as JSON: integers without a decimal point, and no numbers with hundreds of digits."""
    if isinstance(value, float):
        if not math.isfinite(value):
            return "infinity" if math.isinf(value) else "NaN"
        return str(int(value)) if value == int(value) and abs(value) < _LARGE else repr(value)
    return str(value) if abs(value) < _LARGE else "such a large number"


def _quoted(text: str) -> str:
    return repr(text if len(text) <= MAX_SHOWN_CHARS else text[:MAX_SHOWN_CHARS] + "…")


MAX_COMPARED: Final = 10
"""Maximum number of unknown fields to compare. A document may have thousands."""
Branches = dict[str, list[Fault]]


def of_nearest_forms(faults: Sequence[Fault]) -> list[Fault]:
    """Drop errors of unintended branches: other kinds of value, more errors, or less similar names."""
    nearest = list(faults)
    for depth in range(max((len(fault.place.forms) for fault in faults), default=0)):
        nearest = list(_of_depth(nearest, depth))
    return nearest


def _of_depth(faults: Sequence[Fault], depth: int) -> Iterator[Fault]:
    unions: dict[Path, Branches] = {}
    for fault in faults:
        if len(fault.place.forms) > depth:
            form = fault.place.forms[depth]
            unions.setdefault(form.union, {}).setdefault(form.label, []).append(fault)
    done: set[Path] = set()
    for fault in faults:
        if len(fault.place.forms) <= depth:
            yield fault
            continue
        union = fault.place.forms[depth].union
        if union not in done:
            done.add(union)
            yield from _meant(unions[union], depth)


def _meant(branches: Branches, depth: int) -> list[Fault]:
    ranked = sorted(
        branches.values(), key=lambda found: (_is_other_kind(found, depth), len(found), -_nearly_named(found))
    )
    meant = ranked[0]
    if _is_other_kind(meant, depth):
        wanted = dict.fromkeys(kind for found in ranked for fault in found for kind in fault.wanted)
        return [replace(meant[0], wanted=tuple(wanted))]
    equal = [found for found in ranked[1:] if len(found) == len(meant) and not _is_other_kind(found, depth)]
    instead = tuple([str(fault.place.path[-1]) for fault in equal[0] if fault.kind == "missing"]) if equal else ()
    return [replace(fault, instead=instead) if fault.kind == "missing" else fault for fault in meant]


def _is_other_kind(branch: Sequence[Fault], depth: int) -> bool:
    """Whether the value is of another kind than the branch: a number instead of an object."""
    return any(fault.wanted and fault.place.path == fault.place.forms[depth].path for fault in branch)


def _nearly_named(branch: Sequence[Fault]) -> int:
    """Count the unknown fields that are probably misspelled fields of this branch."""
    unknown = [fault.place for fault in branch if fault.kind == "extra_forbidden"][:MAX_COMPARED]
    return sum(near_name(str(place.path[-1]), place.fields) is not None for place in unknown)


MAX_FINDINGS: Final = 100
MAX_READ: Final = 1000
"""Maximum number of errors to process. A document can have one per byte."""


def findings_of(
    error: ValidationError,
    model: type[BaseModel],
    document: Any,
    *,
    code_of: Callable[[str], str],
    noun: str = "field",
) -> list[Finding]:
    """Return the problems of a document, at most 100.

    `document` is the validated JSON data (None if it is not JSON), `model` the expected model. `code_of` converts
    pydantic's error type to a code, `noun` is the word for a field. Pointers refer to existing locations, except for a
    missing field, where the last part is the name of the field.
    """
    places = places_of(model)
    errors = error.errors(include_url=False, include_input=False)[:MAX_READ]
    faults = of_nearest_forms([_fault(details, places) for details in errors])
    parents = {fault.place.path[:count] for fault in faults for count in range(len(fault.place.path))}
    listed = [fault for fault in faults if not (fault.kind == "too_short" and fault.place.path in parents)]
    return [_finding(fault, document, code_of(fault.kind), noun) for fault in listed[:MAX_FINDINGS]]


def document_of(text: bytes | str) -> Any:
    """Parse JSON as pydantic does. Returns None if it is invalid."""
    try:
        return from_json(text)
    except ValueError:
        return None


def _fault(details: ErrorDetails, places: Places) -> Fault:
    kind = details["type"]
    wanted = (WANTED[kind],) if kind in WANTED else ()
    return Fault(kind, details["msg"], details.get("ctx", {}), places.find(details["loc"]), wanted)


def _finding(fault: Fault, document: Any, code: str, noun: str) -> Finding:
    path = fault.place.path
    there, value = _reach(document, path)
    around = _reach(document, path[:-1])[1]
    if fault.kind == "missing" and len(there) == len(path) - 1:
        there = path
    pointer = fault.context.get("pointer") or json_pointer(*there)
    return Finding(
        code=code,
        severity=Severity.ERROR,
        pointer=_encodable(pointer),
        message=_encodable(message_of(fault, value, noun=noun)),
        hint=_encodable(hint_of(fault, around)),
    )


def _reach(document: Any, path: Path) -> tuple[Path, Any]:
    """Return the part of the path that exists in the document, and the value there."""
    for count, part in enumerate(path):
        if isinstance(document, Mapping) and part in document:
            document = document[part]
        elif isinstance(document, Sequence) and not isinstance(document, str) and _is_index(part, document):
            document = document[int(part)]
        else:
            return path[:count], document
    return path, document


def _is_index(part: str | int, entries: Sequence[Any]) -> bool:
    return isinstance(part, int) and part < len(entries)


def _encodable(text: str) -> str:
    """JSON allows lone surrogates. Responses do not."""
    return text.encode("utf-8", "replace").decode()

"""From pydantic's error to findings: plain words, pointers into the document as it was sent, one branch of a union."""

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

# What is wrong in a sentence, and how to mend it: pydantic speaks to those who wrote the model, these words do not.


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
        case _:
            pass
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


# Of a union without a tag pydantic says what is wrong with each branch; told is only the one that was meant.


MAX_COMPARED: Final = 10
"""Unknown fields whose names are looked at; a document may have thousands."""
Branches = dict[str, list[Fault]]


def of_nearest_forms(faults: Sequence[Fault]) -> list[Fault]:
    """The faults without those of branches that were not meant: of another kind, with more faults, or farther names."""
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
    """Whether the value as a whole is not of the branch's kind: a number for an object."""
    return any(fault.wanted and fault.place.path == fault.place.forms[depth].path for fault in branch)


def _nearly_named(branch: Sequence[Fault]) -> int:
    """How many unknown fields are probably misspelt ones of this branch."""
    unknown = [fault.place for fault in branch if fault.kind == "extra_forbidden"][:MAX_COMPARED]
    return sum(near_name(str(place.path[-1]), place.fields) is not None for place in unknown)


MAX_FINDINGS: Final = 100
MAX_READ: Final = 1000
"""Errors that are looked at: a document can have one in every byte or two."""


def findings_of(
    error: ValidationError,
    model: type[BaseModel],
    document: Any,
    *,
    code_of: Callable[[str], str],
    noun: str = "field",
) -> list[Finding]:
    """What is wrong with a document, at most 100 findings.

    `document` is what was validated, as plain JSON data (None if it is no JSON); `model` what it should have been.
    `code_of` makes a finding's code of pydantic's error type, `noun` is what a field is called. A pointer leads to what
    is in the document; only of a field that is missing the last part is not there, which says where it belongs.
    """
    places = places_of(model)
    errors = error.errors(include_url=False, include_input=False)[:MAX_READ]
    faults = of_nearest_forms([_fault(details, places) for details in errors])
    parents = {fault.place.path[:count] for fault in faults for count in range(len(fault.place.path))}
    told = [fault for fault in faults if not (fault.kind == "too_short" and fault.place.path in parents)]
    return [_finding(fault, document, code_of(fault.kind), noun) for fault in told[:MAX_FINDINGS]]


def document_of(text: bytes | str) -> Any:
    """JSON as plain data, as pydantic reads it; None if it is none."""
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
    """As much of the path as the document has, and what stands there."""
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
    """JSON can say half a character; no answer can."""
    return text.encode("utf-8", "replace").decode()

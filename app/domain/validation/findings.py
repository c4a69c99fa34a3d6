"""From pydantic's error to findings: plain words, pointers into the document as it was sent, one branch of a union."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails, from_json

from app.domain.finding import Finding, Severity, json_pointer
from app.domain.validation.fault import WANTED, Fault
from app.domain.validation.nearest_form import of_nearest_forms
from app.domain.validation.places import Path, Places, places_of
from app.domain.validation.words import hint_of, message_of

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

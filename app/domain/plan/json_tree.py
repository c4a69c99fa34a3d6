"""Parses untrusted JSON: checks depth, numbers and duplicate keys. Reports all problems, with pointers."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from app.domain.validation.finding import Finding, Severity, json_pointer

MAX_BODY_BYTES = 1_048_576
"""1 MiB of JSON."""
MAX_NODES = 100_000
"""Objects and arrays. A plan of MAX_BODY_BYTES has 30,000, a .plan 60,000; to copy more takes long."""
MAX_ITEMS = 1000
MAX_DEPTH = 16
"""Nesting of arrays and objects. The format needs five levels."""
MAX_INTEGER_DIGITS = 18
MAX_KEY_CHARS = 200
"""Length of a field name. All findings below a field repeat its name."""
MAX_FINDINGS = 100
"""Maximum number of findings per document."""
MAX_POLYGONS = 64
MAX_VERTICES = 1000
MAX_RALLY_POINTS = 256


@dataclass(frozen=True, slots=True)
class _Unusable:
    """Marks an unusable value in the tree until its pointer is known."""

    code: str
    message: str


class _Object(dict[str, Any]):
    """A JSON object that records duplicate keys."""

    duplicates: tuple[str, ...] = ()


@dataclass(slots=True)
class JsonTree:
    """`value` is plain JSON data, safe to use only if `findings` is empty."""

    value: Any = None
    findings: list[Finding] = field(default_factory=list)

    def refuse(self, code: str, pointer: str, message: str, hint: str = "") -> None:
        if len(self.findings) < MAX_FINDINGS:
            self.findings.append(
                Finding(code=code, severity=Severity.ERROR, pointer=pointer, message=message, hint=hint)
            )

    def add(self, findings: Iterable[Finding]) -> None:
        """Findings that were collected elsewhere."""
        self.findings.extend(findings)


Outline = Callable[[Any], Iterable[Finding]]
"""Looks at what a JSON reader returned, before any of it is checked. What it finds ends the reading."""


def _no_outline(_: Any) -> Iterable[Finding]:
    return ()


def read_data(value: Any, outline: Outline = _no_outline) -> JsonTree:
    """Check the output of a JSON reader and return plain JSON data. Never raises."""
    tree = JsonTree()
    tree.add(outline(value))
    if not tree.findings:
        tree.value = _copy(value, (), tree)
    return tree


def read_json(raw: bytes | str, outline: Outline = _no_outline) -> JsonTree:
    """Parse text and return plain, checked JSON data. Never raises."""
    tree = JsonTree()
    text = _decode(raw, tree)
    if text is None:
        return tree
    try:
        value = json.loads(
            text,
            object_pairs_hook=_object,
            parse_constant=_constant,
            parse_float=_float,
            parse_int=_integer,
        )
    except ValueError as error:
        tree.refuse("plan.not_json", "", f"invalid JSON: {error}", "a plan is a JSON object")
        return tree
    tree.add(outline(value))
    if not tree.findings:
        tree.value = _copy(value, (), tree)
    return tree


def _decode(raw: bytes | str, tree: JsonTree) -> str | None:
    size = len(raw) if isinstance(raw, bytes) else len(raw.encode("utf-8", "surrogatepass"))
    if size > MAX_BODY_BYTES:
        tree.refuse("plan.too_large", "", f"the plan has {size} bytes; the limit is {MAX_BODY_BYTES}")
        return None
    try:
        text = raw.decode("utf-8-sig") if isinstance(raw, bytes) else raw  # editors on Windows begin files with a BOM
    except UnicodeDecodeError as error:
        tree.refuse("plan.not_json", "", f"the plan is not valid UTF-8: {error.reason} at byte {error.start}")
        return None
    if (nodes := text.count("[") + text.count("{")) > MAX_NODES:
        tree.refuse("plan.too_large", "", f"{nodes} objects and arrays; the limit is {MAX_NODES}")
        return None
    if _depth(text) > MAX_DEPTH:
        tree.refuse("plan.too_deep", "", f"nested deeper than {MAX_DEPTH} levels")
        return None
    return text


# Fast path: a valid document is read at once. Anything doubtful takes the slow path above.


MAX_FIELDS = 40
"""Fields of one object: no model has so many, and more errors could not be reported at once."""
_SCALARS = frozenset({str, int, float, bool, type(None)})


class _NotAtOnceError(ValueError):
    pass


def read_at_once(raw: Any) -> Any:
    """Return plain JSON data of a text or of a JSON reader's output, None if something may be wrong with it."""
    if not isinstance(raw, bytes | str):
        return raw if _is_plain(raw, MAX_DEPTH) else None
    try:
        text = raw.decode("utf-8-sig") if isinstance(raw, bytes) else raw
        if len(raw if isinstance(raw, bytes) else text.encode()) > MAX_BODY_BYTES:
            return None
        return json.loads(text, object_pairs_hook=_object_at_once)
    except (ValueError, RecursionError):
        return None


def _object_at_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    made = dict(pairs)
    if len(made) < len(pairs) or len(pairs) > MAX_FIELDS:
        raise _NotAtOnceError
    return made


def _is_plain(value: Any, levels: int) -> bool:
    """Whether it is plain JSON, without oversized objects."""
    kind = type(value)
    if kind in _SCALARS:
        return True
    if levels == 0:
        return False
    if kind is dict:
        return len(value) <= MAX_FIELDS and all(
            type(key) is str and _is_plain(entry, levels - 1) for key, entry in value.items()
        )
    return kind is list and all(_is_plain(entry, levels - 1) for entry in value)


_NAMES = {"nan": "NaN", "inf": "Infinity", "-inf": "-Infinity"}
_STRING = re.compile(r'"[^"\\]*(?:\\.[^"\\]*)*"', re.DOTALL)
_BRACKET = re.compile(r"[\[\]{}]")


def _depth(text: str) -> int:
    """Return the deepest nesting, without recursion: json.loads would exhaust the stack first."""
    depth = deepest = 0
    for bracket in _BRACKET.findall(_STRING.sub("", text)):
        depth += 1 if bracket in "[{" else -1
        deepest = max(deepest, depth)
    return deepest


def _object(pairs: list[tuple[str, Any]]) -> _Object:
    made = _Object(pairs)
    if len(made) < len(pairs):
        times = Counter(key for key, _ in pairs)
        made.duplicates = tuple(key for key in made if times[key] > 1)
    return made


def _constant(name: str) -> _Unusable:
    return _Unusable("plan.not_finite", f"{name} is not a finite number")


def _float(text: str) -> float | _Unusable:
    value = float(text)
    return value if math.isfinite(value) else _Unusable("plan.not_finite", "the number is too large")


def _integer(text: str) -> int | _Unusable:
    if len(text) > MAX_INTEGER_DIGITS:
        return _Unusable("plan.not_finite", "the number is too large")
    return int(text)


def _copy(value: Any, path: tuple[str | int, ...], tree: JsonTree) -> Any:
    """Copy plain data. Records everything unusable with its pointer."""
    if len(path) > MAX_DEPTH:
        tree.refuse("plan.too_deep", json_pointer(*path), f"nested deeper than {MAX_DEPTH} levels")
        return None
    if isinstance(value, Mapping):
        return _copy_object(value, path, tree)
    if isinstance(value, (list, tuple)):
        return [_copy(item, (*path, index), tree) for index, item in enumerate(value)]
    return _copy_scalar(value, path, tree)


def _copy_object(value: Mapping[Any, Any], path: tuple[str | int, ...], tree: JsonTree) -> dict[str, Any]:
    for key in getattr(value, "duplicates", ()):
        tree.refuse("plan.duplicate_key", _pointer((*path, key)), "duplicate key", "remove one of them")
    made: dict[str, Any] = {}
    for key, item in value.items():
        if not isinstance(key, str) or not _is_text(key):
            tree.refuse("plan.not_json", _pointer(path), "a key is not valid Unicode")
        elif len(key) > MAX_KEY_CHARS:
            tree.refuse("plan.unknown_field", json_pointer(*path, key), f"the field name has {len(key)} characters")
        else:
            made[key] = _copy(item, (*path, key), tree)
    return made


def _copy_scalar(value: Any, path: tuple[str | int, ...], tree: JsonTree) -> Any:
    if isinstance(value, _Unusable):
        tree.refuse(value.code, json_pointer(*path), value.message, "omit the field, or set it to null if unknown")
    elif isinstance(value, float) and not math.isfinite(value):
        tree.refuse("plan.not_finite", json_pointer(*path), f"{_NAMES[str(value)]} is not a finite number")
    elif isinstance(value, int) and abs(value) >= 10**MAX_INTEGER_DIGITS:
        tree.refuse("plan.not_finite", json_pointer(*path), "the number is too large")
    elif isinstance(value, str) and not _is_text(value):
        tree.refuse("plan.not_json", json_pointer(*path), "the text is not valid Unicode (a lone surrogate)")
    elif value is None or isinstance(value, (bool, int, float, str)):
        return value
    else:
        tree.refuse("plan.not_json", json_pointer(*path), f"a {type(value).__name__} is not a JSON value")
    return None


def _is_text(value: str) -> bool:
    return not any("\ud800" <= character <= "\udfff" for character in value)


def _pointer(path: tuple[Any, ...]) -> str:
    """Build a pointer that can be encoded, whatever the keys are."""
    return json_pointer(*path).encode("utf-8", "replace").decode("utf-8")

"""What a conversion omitted, what it assumed, and why it was rejected."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Final, TypeGuard

from app.domain.model import FrozenForm
from app.domain.plan.json_tree import MAX_FINDINGS
from app.domain.validation.finding import Finding, Severity, UnfitDocumentError, json_pointer

MAX_LISTED: Final = 200
"""The number of findings that are listed; of the others only the number per code is reported."""


class FindingKind(StrEnum):
    """`lost` is not in the result. `assumed` is in the result and was not in the source. `kept` is in the result, but

    only where Waydrop reads it: other software passes over it.
    """

    LOST = "lost"
    ASSUMED = "assumed"
    KEPT = "kept"


class ConversionFinding(FrozenForm):
    """One thing that a conversion changed. `pointer` is a JSON pointer into the source, `code` is stable."""

    kind: FindingKind
    code: str
    pointer: str
    message: str
    hint: str = ""


class ConversionRefused(UnfitDocumentError, code="conversion.refused"):  # noqa: N818 - as PlanInvalid
    """The document cannot become a plan. `findings` says why and where; all at once, at most 100."""


@dataclass(slots=True)
class Report:
    """Collects while a document is read. What was refused has no result."""

    refusals: list[Finding] = field(default_factory=list)
    findings: list[ConversionFinding] = field(default_factory=list)
    """The first findings; `summarized` adds a summary of the others."""
    _more: dict[FindingKind, Counter[str]] = field(default_factory=dict)

    def refuse(self, code: str, pointer: str, message: str, hint: str = "") -> None:
        if len(self.refusals) < MAX_FINDINGS:
            self.refusals.append(
                Finding(code=code, severity=Severity.ERROR, pointer=pointer, message=message, hint=hint)
            )

    def lose(self, code: str, pointer: str, message: str, hint: str = "") -> None:
        self._add(FindingKind.LOST, code, pointer, message, hint)

    def assume(self, code: str, pointer: str, message: str, hint: str = "") -> None:
        self._add(FindingKind.ASSUMED, code, pointer, message, hint)

    def keep(self, code: str, pointer: str, message: str, hint: str = "") -> None:
        self._add(FindingKind.KEPT, code, pointer, message, hint)

    def refused(self, code: str, message: str, hint: str = "") -> ConversionRefused:
        """Refuse the whole document: the error to raise."""
        self.refuse(code, "", message, hint)
        return ConversionRefused(self.refusals)

    def stop_if_refused(self) -> None:
        """Raises ConversionRefused if anything was refused so far."""
        if self.refusals:
            raise ConversionRefused(self.refusals)

    def summarized(self) -> tuple[ConversionFinding, ...]:
        """All findings; beyond MAX_LISTED one for each kind, with how many more and of which codes."""
        return (*self.findings, *(_summary(kind, codes) for kind, codes in self._more.items()))

    def _add(self, kind: FindingKind, code: str, pointer: str, message: str, hint: str) -> None:
        if len(self.findings) < MAX_LISTED:
            self.findings.append(ConversionFinding(kind=kind, code=code, pointer=pointer, message=message, hint=hint))
        else:
            self._more.setdefault(kind, Counter())[code] += 1


def _summary(kind: FindingKind, codes: Counter[str]) -> ConversionFinding:
    each = ", ".join(f"{code} {count}" for code, count in sorted(codes.items()))
    message = f"findings of this kind beyond the first {MAX_LISTED}: {each}"
    return ConversionFinding(kind=kind, code="conversion.more", pointer="", message=message)


_LARGEST: Final = 2**31
_NAMED: Final = 20
"""Unknown fields of one object that are named one by one."""
_NAMES: Mapping[type, str] = {dict: "an object", list: "an array", str: "a text", bool: "true or false"}


def is_number(value: object) -> TypeGuard[float]:
    """A JSON number; true and false are none."""
    return isinstance(value, (int, float)) and not isinstance(value, bool)


class FileObject:
    """One object of the file. Each reader returns None if the value is missing or unusable, which is then refused."""

    def __init__(self, value: Mapping[str, Any], pointer: str, report: Report) -> None:
        self.value = value
        self.pointer = pointer
        self._report = report

    def at(self, key: str) -> str:
        return self.pointer + json_pointer(key)

    def typed(self, key: str, kind: type, *, required: bool = True) -> Any:
        """A value of this JSON type."""
        value = self.value.get(key)
        if isinstance(value, kind):
            return value
        self._refuse(key, _NAMES[kind], required=required)
        return None

    def whole(self, key: str, *, required: bool = True) -> int | None:
        """An integer; `16.0` is one."""
        value = self.value.get(key)
        if is_number(value) and abs(value) <= _LARGEST and value == int(value):
            return int(value)
        self._refuse(key, "an integer", required=required)
        return None

    def number(self, key: str, *, required: bool = True) -> float | None:
        value = self.value.get(key)
        if is_number(value):
            return float(value)
        self._refuse(key, "a number", required=required)
        return None

    def _refuse(self, key: str, wanted: str, *, required: bool) -> None:
        if key in self.value:
            self._report.refuse("conversion.wrong_type", self.at(key), f"{key} must be {wanted}")
        elif required:
            self._report.refuse("conversion.missing", self.pointer, f"the field {key!r} is missing")

    def version(self, expected: int) -> None:
        """Refuses every other version of the format."""
        found = self.whole("version")
        if found is not None and found != expected:
            message = f"this is version {found} of the format; version {expected} is read"
            hint = "open it in a current QGroundControl and save it again"
            self._report.refuse("conversion.version", self.at("version"), message, hint)

    def numbers(self, key: str, count: int, *, required: bool = True) -> list[float | None] | None:
        """An array of this many numbers or nulls."""
        value = self.typed(key, list, required=required)
        return None if value is None else read_numbers(value, self.at(key), count, self._report)

    def name_unknown(self, known: Iterable[str]) -> None:
        """What the file says in keys that are not in the documented format is lost."""
        unknown = sorted(set(self.value) - set(known))
        for key in unknown[:_NAMED]:
            self._report.lose("conversion.unknown_field", self.at(key), f"unknown field {key!r}")
        if len(unknown) > _NAMED:
            message = f"{len(unknown) - _NAMED} more fields here"
            self._report.lose("conversion.unknown_field", self.pointer, message)


def read_numbers(value: Any, pointer: str, count: int, report: Report) -> list[float | None] | None:
    """An array of exactly `count` numbers or nulls."""
    if not isinstance(value, list) or len(value) != count:
        report.refuse("conversion.wrong_type", pointer, f"this must be an array of {count} numbers")
        return None
    wrong = [index for index, item in enumerate(value) if item is not None and not is_number(item)]
    for index in wrong:
        report.refuse("conversion.wrong_type", f"{pointer}/{index}", "this must be a number or null")
    return None if wrong else [None if item is None else float(item) for item in value]

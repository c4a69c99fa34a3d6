"""What a conversion could not carry, what it assumed, and why it was refused."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from pydantic import BaseModel, ConfigDict

from app.domain.finding import Finding, Severity, UnfitDocumentError
from app.domain.plan.size_limits import MAX_FINDINGS

MAX_TOLD: Final = 200
"""Findings that are told one by one; of the rest it is said how many there are of each code."""


class FindingKind(StrEnum):
    """`lost` is not in the result. `assumed` is in the result and was not in the source. `kept` is in the result, but

    only where Waydrop reads it: other software passes over it.
    """

    LOST = "lost"
    ASSUMED = "assumed"
    KEPT = "kept"


class ConversionFinding(BaseModel):
    """One thing that a conversion changed. `pointer` is a JSON pointer into the source, `code` is stable."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: FindingKind
    code: str
    pointer: str
    message: str
    hint: str = ""


class ConversionRefused(UnfitDocumentError):  # noqa: N818 - as PlanInvalid
    """The document cannot become a plan. `findings` says why and where; all at once, at most 100."""

    code = "conversion.refused"


@dataclass(slots=True)
class Report:
    """Collects while a document is read. What was refused has no result."""

    refusals: list[Finding] = field(default_factory=list)
    findings: list[ConversionFinding] = field(default_factory=list)
    """The first ones; `told` has the rest too."""
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

    def stop_if_refused(self) -> None:
        """Raises ConversionRefused if anything was refused so far."""
        if self.refusals:
            raise ConversionRefused(self.refusals)

    def told(self) -> tuple[ConversionFinding, ...]:
        """All findings; beyond MAX_TOLD one for each kind, with how many more and of which codes: none is silent."""
        return (*self.findings, *(_summary(kind, codes) for kind, codes in self._more.items()))

    def _add(self, kind: FindingKind, code: str, pointer: str, message: str, hint: str) -> None:
        if len(self.findings) < MAX_TOLD:
            self.findings.append(ConversionFinding(kind=kind, code=code, pointer=pointer, message=message, hint=hint))
        else:
            self._more.setdefault(kind, Counter())[code] += 1


def _summary(kind: FindingKind, codes: Counter[str]) -> ConversionFinding:
    each = ", ".join(f"{code} {count}" for code, count in sorted(codes.items()))
    message = f"beyond the first {MAX_TOLD} findings there are of this kind: {each}"
    return ConversionFinding(kind=kind, code="conversion.more", pointer="", message=message)

"""Findings: errors and warnings at a location of a document, and the error that carries them."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

from app.domain.errors import InvalidInputError
from app.domain.model import FrozenForm


class Severity(StrEnum):
    """An error rejects the plan. A warning is displayed and stored with the run."""

    ERROR = "error"
    WARNING = "warning"


class Finding(FrozenForm):
    """`code` is stable, `pointer` is a JSON Pointer (RFC 6901) into the document, `hint` says how to fix the problem.

    `assumed` lists facts of the vehicle that are unknown and were assumed: parameters, `firmware`, `home` ...
    Such a finding depends on the vehicle. As long as no vehicle is named, it is a warning.
    """

    code: str
    severity: Severity
    pointer: str
    message: str
    hint: str = ""
    item_id: str | None = None
    assumed: tuple[str, ...] = ()


class UnfitDocumentError(InvalidInputError):
    """The document is invalid. `findings` has at least one entry, and lists all problems at once."""

    def __init__(self, findings: Sequence[Finding]) -> None:
        self.findings = tuple(findings)
        first = self.findings[0]
        super().__init__(
            f"{first.message} (at {first.pointer})" if first.pointer else first.message,
            hint=first.hint,
            findings=[finding.model_dump(mode="json") for finding in self.findings],
        )


def json_pointer(*path: str | int) -> str:
    """Build a JSON Pointer from keys and indexes. Without arguments it refers to the whole document."""
    return "".join("/" + str(part).replace("~", "~0").replace("/", "~1") for part in path)

"""A finding: one thing that is wrong or doubtful in a plan, and where; and the error of a document that has some."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

from pydantic import BaseModel, ConfigDict

from app.domain.errors import InvalidInputError


class Severity(StrEnum):
    """An error stops the plan; a warning is shown and stays with the run."""

    ERROR = "error"
    WARNING = "warning"


class Finding(BaseModel):
    """`code` is stable, `pointer` a JSON pointer (RFC 6901) into the plan, `hint` says how to mend it.

    `assumed` names the facts of the vehicle that are not known and were assumed: parameters, `firmware`, `home` ...
    Such a finding depends on the vehicle: while none is named it is a warning.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    code: str
    severity: Severity
    pointer: str
    message: str
    hint: str = ""
    item_id: str | None = None
    assumed: tuple[str, ...] = ()


class UnfitDocumentError(InvalidInputError):
    """A document cannot be read. `findings`, at least one, say what is wrong and where; all at once."""

    def __init__(self, findings: Sequence[Finding]) -> None:
        self.findings = tuple(findings)
        first = self.findings[0]
        super().__init__(
            f"{first.message} (at {first.pointer})" if first.pointer else first.message,
            hint=first.hint,
            findings=[finding.model_dump(mode="json") for finding in self.findings],
        )


def json_pointer(*path: str | int) -> str:
    """A JSON pointer out of keys and indexes; no argument is the whole document."""
    return "".join("/" + str(part).replace("~", "~0").replace("/", "~1") for part in path)

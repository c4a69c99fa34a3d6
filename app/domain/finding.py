"""A finding: one thing that is wrong or doubtful in a plan, and where."""

from __future__ import annotations

from enum import StrEnum

from pydantic import BaseModel, ConfigDict


class Severity(StrEnum):
    """An error stops the plan; a warning is shown and stays with the run."""

    ERROR = "error"
    WARNING = "warning"


class Finding(BaseModel):
    """`code` is stable, `pointer` a JSON pointer (RFC 6901) into the plan, `hint` says how to mend it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    code: str
    severity: Severity
    pointer: str
    message: str
    hint: str = ""
    item_id: str | None = None


def json_pointer(*path: str | int) -> str:
    """A JSON pointer out of keys and indexes; no argument is the whole document."""
    return "".join("/" + str(part).replace("~", "~0").replace("/", "~1") for part in path)

"""The parameter audit before offboard control: what the vehicle does by itself when the stream stops."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class AuditEntry:
    """One parameter. `blocks`: offboard control is not entered while it is so. `value` None: it did not answer."""

    parameter: str
    value: float | None
    blocks: bool
    meaning: str

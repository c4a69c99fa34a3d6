"""Checks the way over the alternates by the same rules as the flight that is meant."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from app.domain.finding import Finding
from app.domain.plan.detour import Detour


def detour_findings(detour: Detour, found: Collection[Finding], known: Collection[Finding]) -> Iterator[Finding]:
    """What is wrong on the way over the alternates alone, with pointers into the plan as it was written.

    `found` are the findings of the detour's own plan, `known` those of the plan that is meant.
    """
    told = {(finding.code, finding.pointer) for finding in known}
    for finding in found:
        pointer = _pointer(detour, finding.pointer)
        if (finding.code, pointer) not in told:
            item_id = detour.drops.get(finding.item_id or "", finding.item_id)
            message = f"over the alternate: {finding.message}"
            yield finding.model_copy(update={"pointer": pointer, "item_id": item_id, "message": message})


def _pointer(detour: Detour, pointer: str) -> str:
    """/items/N/rest, with the N of the plan over its alternates, as it is in the plan itself."""
    parts = pointer.split("/", 3)
    if len(parts) < 3 or parts[1] != "items":
        return pointer
    return "/".join((detour.pointers[int(parts[2])], *parts[3:]))

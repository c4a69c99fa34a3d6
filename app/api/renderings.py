"""Stored plans written in the formats of other software: each once, kept a while, one at a time."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from typing import Final

from app.domain.plan import parse_plan
from app.domain.ports import StoredPlan
from app.interchange.target import Exported, TargetFormat, export_plan

KEPT: Final = 32
"""Documents kept: a plan of 1000 items makes one of about a megabyte."""


class Renderings:
    """Writes exports in a thread. A plan never changes, so what was written of it holds.

    One at a time: it is a second of pure Python for 1000 items, and the loop that watches drops shares the interpreter
    with whatever is written meanwhile.
    """

    def __init__(self, kept: int = KEPT) -> None:
        self._kept = kept
        self._documents: OrderedDict[tuple[str, TargetFormat], Exported] = OrderedDict()
        self._turn = asyncio.Lock()

    async def of(self, stored: StoredPlan, target: TargetFormat) -> Exported:
        """The plan in this format. Raises PlanInvalid: another version accepted it, and this one cannot read it."""
        key = (stored.id, target)
        if key not in self._documents:
            async with self._turn:
                if key not in self._documents:  # written while this one waited
                    self._keep(key, await asyncio.to_thread(_write, stored, target))
                return self._documents[key]
        self._documents.move_to_end(key)
        return self._documents[key]

    def _keep(self, key: tuple[str, TargetFormat], written: Exported) -> None:
        self._documents[key] = written
        if len(self._documents) > self._kept:
            self._documents.popitem(last=False)


def _write(stored: StoredPlan, target: TargetFormat) -> Exported:
    return export_plan(parse_plan(stored.document), target)

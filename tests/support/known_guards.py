"""LinkGuards whose counts and keys a test sets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from app.domain.errors import NotFoundError, WaydropError
from app.domain.vehicle.link_security import Refused, Relayed


@dataclass
class KnownGuards:
    """`keys`: fingerprints of the newest keys, by system id. `refusal` is raised by whatever is asked next."""

    refusals: list[Refused] = field(default_factory=list)
    passed: list[Relayed] = field(default_factory=list)
    keys: dict[int, str] = field(default_factory=dict)
    refusal: WaydropError | None = None

    def refused(self) -> Sequence[Refused]:
        return self.refusals

    def relayed(self) -> Sequence[Relayed]:
        return self.passed

    async def set_up_signing(self, system_id: int, connection: str) -> str:
        if self.refusal is not None:
            raise self.refusal
        if system_id not in self.keys:
            raise NotFoundError(f"system {system_id} has no key")
        return self.keys[system_id]

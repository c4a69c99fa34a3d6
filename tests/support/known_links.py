"""A LinkSource whose vehicles are there from the start."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from app.domain.ports.vehicle_link import Unsubscribe, VehicleLink


class KnownLinks:
    """LinkSource with these vehicles; it finds no more."""

    def __init__(self, *links: VehicleLink) -> None:
        self._links = links

    def links(self) -> Sequence[VehicleLink]:
        return self._links

    def subscribe(self, listener: Callable[[VehicleLink], None]) -> Unsubscribe:
        return lambda: None

    async def start(self) -> None:
        """Nothing to open."""

    async def close(self) -> None:
        """Nothing to close."""

"""A LinkSource whose vehicles are there from the start, or are switched on by the test."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from app.domain.ports.vehicle_link import Unsubscribe, VehicleLink


class KnownLinks:
    """LinkSource with these vehicles; it finds others when told to."""

    def __init__(self, *links: VehicleLink) -> None:
        self._links = list(links)
        self._listeners: dict[int, Callable[[VehicleLink], None]] = {}

    def links(self) -> Sequence[VehicleLink]:
        return self._links

    def subscribe(self, listener: Callable[[VehicleLink], None]) -> Unsubscribe:
        self._listeners[id(listener)] = listener

        def unsubscribe() -> None:
            self._listeners.pop(id(listener), None)

        return unsubscribe

    def find(self, *links: VehicleLink) -> None:
        """These are heard for the first time."""
        self._links.extend(links)
        for link in links:
            for listener in tuple(self._listeners.values()):
                listener(link)

    async def start(self) -> None:
        """Nothing to open."""

    async def close(self) -> None:
        """Nothing to close."""

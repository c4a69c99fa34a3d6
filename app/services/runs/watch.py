"""Feeds a flight: what is seen, asked and answered goes in, its events go to the recorder, its orders to the caller."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import replace

from app.domain.flight.flight import Flight
from app.domain.flight.inputs import Commanding, FlightInput, Looked, Record, Sight, Told
from app.domain.flight.look import Look
from app.domain.flight.orders import Order
from app.domain.flight.step import step
from app.domain.flight.supervised_release import SupervisedRelease
from app.domain.ports import LinkFact, VehicleLink
from app.domain.run import Asked
from app.services.clock import Clock
from app.services.runs.recorder import RunRecorder
from app.services.targets import Targets


class FlightWatch:
    """Holds the flight's state. It commands nothing: whoever feeds it carries out the orders."""

    def __init__(
        self, link: VehicleLink, flight: Flight, recorder: RunRecorder, clock: Clock, targets: Targets
    ) -> None:
        self._link = link
        self._flight = flight
        self._recorder = recorder
        self._clock = clock
        self._targets = targets

    @property
    def flight(self) -> Flight:
        """The flight after the last input, with the run as it is now."""
        return replace(self._flight, run=self._recorder.run)

    def sight(self) -> Sight:
        """The vehicle at this moment."""
        targets = self._targets.fixes(self._flight.leg.feeds)
        return Sight(self._link.state(), self._clock.monotonic(), self._clock.now(), targets)

    def see(self) -> Look:
        """The same, with what the flight knows of it."""
        return self.flight.look(self.sight())

    def feed(self, heard: FlightInput) -> tuple[Order, ...]:
        """One input. What it records waits for the recorder's next flush; what it orders must be sent."""
        self._flight, effects = step(self.flight, heard)
        self._recorder.take(self._flight.run, [effect.payload for effect in effects if isinstance(effect, Record)])
        return tuple([effect for effect in effects if not isinstance(effect, Record)])

    def heard(self, fact: LinkFact) -> None:
        """A fact from the link."""
        self.feed(Told(self.sight(), fact))

    def look(self) -> tuple[Order, ...]:
        """Look once."""
        return self.feed(Looked(self.sight()))

    def supervised(self, plan_item_id: str, leg: int) -> SupervisedRelease | None:
        """A drop that Waydrop commands, as it is now; None once the plan was changed."""
        found = self.flight.find(plan_item_id, leg)
        return found if isinstance(found, SupervisedRelease) else None

    @contextlib.contextmanager
    def commanding(self, asked: Asked) -> Iterator[None]:
        """While the vehicle is told this: modes on the way are nobody else's."""
        self.feed(Commanding(self.sight(), asked))
        try:
            yield
        finally:
            self.feed(Commanding(self.sight(), None))

"""One scripted vehicle under offboard control, with a clock that the test moves and ticks that come by themselves."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from typing import Any

from app.domain.offboard.messages import SetpointMessage
from app.domain.offboard.state import OffboardState
from app.domain.run.run import Run, RunState
from app.domain.vehicle.state import FlightMode, GlobalPosition, LandedState, VehicleType
from app.services.fleet import Fleet
from app.services.journal import Journal
from app.services.offboard import Offboard, OffboardSettings
from app.services.offboard.control import OffboardControl
from app.services.tasks import TaskQueueService, Tasks
from tests.support.events import data_of
from tests.support.fakes import ManualClock, MemoryEventStore
from tests.support.known_links import KnownLinks
from tests.support.scripted_link import ScriptedVehicle
from tests.support.setpoint_examples import example

WITHIN_S = 10.0
SETTINGS = OffboardSettings(rate_hz=50.0, stream_s=0.1, gap_s=60.0, goodbye_s=0.1)
"""Ticks come in real time, but what counts as silent is told by the test's clock."""


@dataclass
class ScriptedRuns:
    """The runs as far as offboard control uses them: one run, or none."""

    vehicle: ScriptedVehicle
    run: Run | None = None
    asked: list[str] = field(default_factory=list)

    async def get(self, run_id: str) -> Run:
        assert self.run is not None
        return self.run

    async def pause(self, run_id: str) -> None:
        self.asked.append("pause")
        await self.vehicle.hold()

    async def resume(self, run_id: str) -> None:
        self.asked.append("resume")
        self.vehicle.put(mode=FlightMode.MISSION)

    async def use_gripper(self, run_id: str) -> None:
        self.asked.append("gripper")

    async def return_to_launch(self, run_id: str) -> None:
        self.asked.append("return")
        await self.vehicle.return_to_launch()


@dataclass
class ControlledVehicle:
    """One vehicle under offboard control, its task queue and the journal."""

    vehicle: ScriptedVehicle
    clock: ManualClock
    runs: ScriptedRuns
    fleet: Fleet
    events: MemoryEventStore
    control: OffboardControl
    tasks: TaskQueueService
    journal: Journal
    lease: str = ""

    @property
    def sent(self) -> list[SetpointMessage]:
        """All setpoints that left."""
        return self.vehicle.setpoints

    def take(self, holder: str = "ann", **more: Any) -> str:
        self.lease = self.control.acquire(holder, rate_hz=50.0, **more).id
        return self.lease

    def put(self, form: str = "velocity_ned", **changes: Any) -> Any:
        return self.control.put(self.lease, example(form, **changes))

    async def enter(self, **more: Any) -> Any:
        return await self.control.enter(self.lease, sticks_held=False, **more)

    async def flown(self) -> None:
        """Take the lease, enter, and send what was put."""
        self.take()
        self.put()
        await self.enter()
        self.put()
        await self.ticks(2)

    async def ticks(self, count: int) -> None:
        """Let ticks pass that send."""
        enough = len(self.sent) + count
        await self.until(lambda: len(self.sent) >= enough, f"{count} more setpoints must be sent")

    async def silent_for(self, seconds: float) -> None:
        """The clock goes on in small steps, and nobody speaks."""
        for _ in range(round(seconds / 0.1)):
            self.clock.time_s += 0.1
            await asyncio.sleep(0.03)

    async def until(self, what: Any, promise: str) -> None:
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(WITHIN_S):
                while not what():
                    await asyncio.sleep(0.005)
        assert what(), f"{promise}; it is {self.control.state.value} ({self.control.reason})"

    async def until_state(self, state: OffboardState) -> None:
        await self.until(lambda: self.control.state is state, f"it must become {state.value}")

    async def quiet(self) -> int:
        """How many setpoints leave within several periods."""
        before = len(self.sent)
        await asyncio.sleep(0.2)
        return len(self.sent) - before

    async def recorded(self, kind: str) -> list[Any]:
        """The data of the recorded events of one kind, once what waits is on disk."""
        async with asyncio.timeout(WITHIN_S):
            await self.fleet.recorded()
        return [data_of(event) for event in self.events.events if event.kind == kind]


@contextlib.asynccontextmanager
async def controlled_vehicle(
    vehicle_type: VehicleType = VehicleType.MULTICOPTER,
    *,
    settings: OffboardSettings = SETTINGS,
    run: Run | None = None,
    **state: object,
) -> AsyncIterator[ControlledVehicle]:
    """A vehicle in the air, in Hold, 20 m above home."""
    vehicle, clock, events = ScriptedVehicle(vehicle_type), ManualClock(), MemoryEventStore()
    home = GlobalPosition(47.397742, 8.545594, 488.0)
    vehicle.put(
        landed=LandedState.IN_AIR,
        absolute_altitude_m=508.0,
        relative_altitude_m=20.0,
        home=home,
        home_ned_m=(0.0, 0.0, 0.0),
        **{"armed": True, **state},
    )
    journal = Journal(events, clock)
    await journal.start()
    fleet = Fleet(KnownLinks(vehicle), journal)
    await fleet.start()
    runs = ScriptedRuns(vehicle, run)
    if run is not None:
        fleet.vehicle("v1").own(run.id)
    offboard = Offboard(fleet, runs, clock, settings)  # type: ignore[arg-type]
    control, tasks = offboard.vehicle("v1"), Tasks(offboard, fleet, runs, clock).vehicle("v1")
    try:
        yield ControlledVehicle(vehicle, clock, runs, fleet, events, control, tasks, journal)
    finally:
        await offboard.close()
        await fleet.close()
        await journal.close()


def paused_run(state: RunState = RunState.PAUSED) -> Run:
    """A run of the vehicle."""
    return Run(
        id="run-1", plan_id="plan-1", plan_hash="h", vehicle_id="v1", state=state, created_at=0.0, updated_at=0.0
    )

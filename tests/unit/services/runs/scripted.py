"""A vehicle whose every answer the test decides, and a desk that flies runs with it."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from app.domain.commands import CommandAck, CommandRequest, MavResult
from app.domain.compiler import compile_plan
from app.domain.default_facts import default_facts
from app.domain.drop import DropRecord
from app.domain.errors import LinkError, VehicleRefusedError
from app.domain.mission import MavCmd, Mission, MissionItem, MissionType
from app.domain.plan import Plan, parse_plan, plan_hash
from app.domain.ports import (
    LinkFact,
    StateChanged,
    StoredPlan,
    Unsubscribe,
    UploadProgress,
    VehicleIdentity,
    VehicleLink,
)
from app.domain.run import Run, RunState
from app.domain.vehicle import (
    FirmwareVersion,
    FlightMode,
    LandedState,
    MissionState,
    VehicleFacts,
    VehicleState,
    VehicleType,
)
from app.services.clock import SystemClock
from app.services.fleet import Fleet
from app.services.journal import Journal
from app.services.runs import Runs, RunSettings
from tests.unit.services.fakes import MemoryEventStore

PLANS = Path(__file__).parents[4] / "plans"
FAST = RunSettings(armable_s=0.05, arm_again_s=0.01, look_every_s=0.005, lost_after_s=0.3, ack_s=0.2, gripper_s=0.5)
WITHIN_S = 5.0


class ScriptedVehicle:
    """Implements VehicleLink. It stays where the test puts it."""

    def __init__(self, vehicle_type: VehicleType = VehicleType.MULTICOPTER) -> None:
        self.identity = VehicleIdentity(1, "udpin://scripted", vehicle_type, FirmwareVersion(1, 18, 0), "uid-1")
        self.facts = default_facts(vehicle_type)
        self.truth = VehicleState(
            connected=True,
            mode=FlightMode.HOLD,
            armed=False,
            landed=LandedState.ON_GROUND,
            latitude_deg=47.397742,
            longitude_deg=8.545594,
            velocity_north_m_s=0.0,
            velocity_east_m_s=0.0,
            mission_state=MissionState.NOT_STARTED,
            mission_seq=0,
        )
        self.listeners: list[Callable[[LinkFact], None]] = []
        self.sent: list[str] = []
        self.releases: list[CommandRequest] = []
        self.answers: list[list[MavResult] | LinkError] = []
        self.on_board: tuple[MissionItem, ...] = ()
        self.upload_error: LinkError | None = None
        self.upload_gate = asyncio.Event()
        self.upload_gate.set()
        self.upload_closed = False
        self.arm_refusals = 0
        self.start_error: LinkError | None = None

    def put(self, *facts: LinkFact, **changes: object) -> None:
        """Change what is true, and tell."""
        self.truth = replace(self.truth, **changes)  # type: ignore[arg-type]
        for listener in tuple(self.listeners):
            for fact in facts or (StateChanged(),):
                listener(fact)

    def state(self) -> VehicleState:
        now_s = time.monotonic()
        return replace(self.truth, boot_time_s=now_s, position_age_s=0.01, heartbeat_age_s=0.1)

    def subscribe(self, listener: Callable[[LinkFact], None]) -> Unsubscribe:
        self.listeners.append(listener)
        return lambda: self.listeners.remove(listener) if listener in self.listeners else None

    async def read_facts(self) -> VehicleFacts:
        return self.facts

    async def upload(self, mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        try:
            yield UploadProgress(MissionType.MISSION, 0, len(mission.items), 1)
            await self.upload_gate.wait()
            if self.upload_error is not None:
                raise self.upload_error
            self.on_board = mission.items
            yield UploadProgress(MissionType.MISSION, len(mission.items), len(mission.items), 1, "mission_id", 77)
        finally:
            self.upload_closed = True

    async def download(self, mission_type: MissionType) -> tuple[MissionItem, ...]:
        return self.on_board

    async def wait_mission_ready(self, *, mission_id: int | None, rerun: bool, timeout_s: float) -> None:
        self.sent.append("wait_ready")

    async def set_current(self, seq: int) -> None:
        self.sent.append(f"set_current {seq}")
        self.put(mission_seq=seq)

    async def arm(self) -> None:
        self.sent.append("arm")
        if self.arm_refusals:
            self.arm_refusals -= 1
            raise VehicleRefusedError("arming denied", texts=["Preflight Fail: no GNSS"])
        self.put(armed=True)

    async def disarm(self) -> None:
        self.sent.append("disarm")
        self.put(armed=False)

    async def start_mission(self) -> None:
        self.sent.append("start")
        if self.start_error is not None:
            raise self.start_error
        self.put(mode=FlightMode.MISSION, mission_state=MissionState.ACTIVE)

    async def hold(self) -> None:
        self.sent.append("hold")
        self.put(mode=FlightMode.HOLD)

    async def return_to_launch(self) -> None:
        self.sent.append("return")
        self.put(mode=FlightMode.RETURN)

    async def land(self) -> None:
        self.sent.append("land")
        self.put(mode=FlightMode.LAND)

    async def command(self, request: CommandRequest) -> AsyncGenerator[CommandAck, None]:
        if request.command is MavCmd.DO_GRIPPER and request.params[1] == 0.0:
            self.releases.append(request)
            answer = self.answers.pop(0) if self.answers else [MavResult.IN_PROGRESS, MavResult.ACCEPTED]
            if isinstance(answer, LinkError):
                raise answer
            for result in answer:
                yield CommandAck(request.command, int(result))
            return
        self.sent.append(f"{request.command.name} {request.params[1]:g}")
        yield CommandAck(request.command, int(MavResult.ACCEPTED))

    async def fly_to_hold(self, latitude_deg: float, longitude_deg: float, seq: int) -> None:
        """Approach a hold item slowly enough to be seen outside its radius, then stop in it."""
        self.put(
            mission_seq=seq, landed=LandedState.IN_AIR, latitude_deg=latitude_deg - 0.0001, longitude_deg=longitude_deg
        )
        await asyncio.sleep(FAST.look_every_s * 4)
        self.put(latitude_deg=latitude_deg)

    def touch_down(self, *, complete: bool, last_seq: int) -> None:
        """Land and disarm."""
        if complete:
            self.put(mission_state=MissionState.COMPLETE, mission_seq=last_seq, mode=FlightMode.RETURN)
        self.put(armed=False, landed=LandedState.ON_GROUND)


class OneVehicle:
    """A LinkSource with one scripted vehicle."""

    def __init__(self, vehicle: ScriptedVehicle) -> None:
        self._vehicle = vehicle

    def links(self) -> Sequence[VehicleLink]:
        return [self._vehicle]

    def subscribe(self, listener: Callable[[VehicleLink], None]) -> Unsubscribe:
        return lambda: None

    async def start(self) -> None:
        return

    async def close(self) -> None:
        return


@dataclass
class MemoryPlans:
    """PlanStore in a dict."""

    plans: dict[str, StoredPlan] = field(default_factory=dict)

    async def add(self, plan: StoredPlan) -> None:
        self.plans[plan.id] = plan

    async def get(self, plan_id: str) -> StoredPlan | None:
        return self.plans.get(plan_id)

    async def list_plans(self, *, limit: int) -> Sequence[StoredPlan]:
        return list(self.plans.values())[:limit]


class MemoryRuns:
    """RunStore over what the event store was given."""

    def __init__(self, events: MemoryEventStore) -> None:
        self._events = events

    async def get(self, run_id: str) -> Run | None:
        return self._events.runs.get(run_id)

    async def list_runs(self, *, limit: int, vehicle_id: str | None = None, open_only: bool = False) -> Sequence[Run]:
        return [r for r in self._events.runs.values() if not (open_only and r.is_over)][:limit]


@dataclass
class Desk:
    """A service with one vehicle and one plan."""

    vehicle: ScriptedVehicle
    events: MemoryEventStore
    journal: Journal
    fleet: Fleet
    runs: Runs
    plan: Plan
    mission: Mission
    run_id: str = ""

    async def create(self, *, start: bool = True) -> Run:
        run = await self.runs.create("plan-1", "v1", start=start, by="test")
        self.run_id = run.id
        return run

    @property
    def run(self) -> Run:
        """The run as stored."""
        return self.events.runs[self.run_id]

    @property
    def drop(self) -> DropRecord:
        """The first drop's record."""
        return self.run.drops[0]

    async def until(self, what: Callable[[], bool], promise: str) -> None:
        """Wait for a condition."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(WITHIN_S):
                while not what():
                    await asyncio.sleep(0.005)
        assert what(), f"{promise}; the run is {self.run.state.value} ({self.run.reason}), drops {self.run.drops}"

    async def until_state(self, *states: RunState) -> None:
        await self.until(lambda: self.run.state in states, f"the run must become {[s.value for s in states]}")

    async def fly_to_drop(self) -> None:
        """Start, and stop in the hold of the first drop."""
        await self.until_state(RunState.FLYING)
        drop = self.mission.drops[0]
        await self.vehicle.fly_to_hold(drop.latitude_deg, drop.longitude_deg, drop.hold_seqs[0])

    def kinds(self) -> list[str]:
        """The kinds of this run's events, in order."""
        return [event.kind.value for event in self.events.events if event.run_id == self.run_id]


@contextlib.asynccontextmanager
async def desk(
    plan_file: str = "clinic-run.json", *, changes: Callable[[dict[str, object]], None] | None = None
) -> AsyncIterator[Desk]:
    """A running service around one scripted vehicle."""
    import json

    document = json.loads((PLANS / plan_file).read_text())
    if changes is not None:
        changes(document)
    plan = parse_plan(document)
    vehicle, events, clock = ScriptedVehicle(plan.vehicle_type), MemoryEventStore(), SystemClock()
    stored = StoredPlan(
        "plan-1", plan_hash(plan), plan.name, plan.vehicle_type, 0.0, "test", plan.model_dump(mode="json")
    )
    plans = MemoryPlans({"plan-1": stored})
    journal = Journal(events, clock)
    await journal.start()
    fleet = Fleet(OneVehicle(vehicle), journal)
    await fleet.start()
    runs = Runs(fleet, plans, MemoryRuns(events), journal, clock, FAST)
    mission = compile_plan(plan, vehicle.facts)
    try:
        yield Desk(vehicle, events, journal, fleet, runs, plan, mission)
    finally:
        await runs.close()
        await fleet.close()
        await journal.close()


async def restarted(before: Desk, *, meanwhile: Callable[[], None] = lambda: None) -> tuple[Runs, Fleet, Journal]:
    """The same vehicle, plans and disk under a new process of the service; the old one is gone without a goodbye."""
    await before.runs.close()
    await before.fleet.close()
    await before.journal.close()
    meanwhile()
    clock = SystemClock()
    journal = Journal(before.events, clock)
    await journal.start()
    fleet = Fleet(OneVehicle(before.vehicle), journal)
    await fleet.start()
    runs = Runs(fleet, before.runs._plans, MemoryRuns(before.events), journal, clock, FAST)
    await runs.begin()
    before.runs, before.fleet, before.journal = runs, fleet, journal
    return runs, fleet, journal

"""A flight with embedded drops, looked at step by step on a clock of its own."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, replace

from app.domain.autopilot.declared import default_facts
from app.domain.drop.record import DropRecord
from app.domain.flight.embedded_release import EmbeddedRelease
from app.domain.flight.progress import GripperTurns, MissionProgress
from app.domain.flight.snapshot import VehicleSnapshot
from app.domain.mission import Mission
from app.domain.plan import parse_plan
from app.domain.plan.compiler import compile_plan
from app.domain.vehicle.state import FlightMode, VehicleState, VehicleType
from tests.support.paths import PLANS


def two_parcels() -> Mission:
    """Release, fly on, grab another, fly on, release that one."""
    document = json.loads((PLANS / "multicopter-embedded.json").read_text())
    takeoff, clinic, drop, home = document["items"]
    depot, school = (
        {**clinic, "id": name, "latitude_deg": at} for name, at in (("depot", 47.3988), ("school", 47.3993))
    )
    grab = {"id": "grab", "type": "gripper", "action": "grab", "release_motion": "stopped"}
    document["items"] = [takeoff, clinic, drop, depot, grab, school, {**drop, "id": "drop2"}, home]
    return compile_plan(parse_plan(document), default_facts(VehicleType.MULTICOPTER))


@dataclass
class EmbeddedFlight:
    """What is seen of the vehicle is set by `put`; each `tick` is one look."""

    mission: Mission
    taken_up: bool = False
    now_s: float = 1000.0
    state: VehicleState = field(
        default_factory=lambda: VehicleState(
            connected=True,
            mode=FlightMode.MISSION,
            armed=True,
            latitude_deg=47.398,
            longitude_deg=8.5456,
            position_age_s=0.1,
            gripper_output_us=2000,
            gripper_output_age_s=0.1,
        )
    )
    progress: MissionProgress = field(init=False)
    releases: list[EmbeddedRelease] = field(init=False)

    def __post_init__(self) -> None:
        self.progress = MissionProgress.of(self.mission)
        self.releases = [
            EmbeddedRelease(
                drop,
                DropRecord(plan_item_id=drop.plan_item_id, supervised=False),
                "continue",
                GripperTurns.of(drop, self.mission),
                math.inf if self.taken_up else -math.inf,
            )
            for drop in self.mission.drops
        ]

    def record(self, plan_item_id: str) -> DropRecord:
        return next(r.record for r in self.releases if r.record.plan_item_id == plan_item_id)

    def seq(self, plan_item_id: str) -> int:
        return self.mission.seqs_of(plan_item_id)[0]

    def tick(self, seconds: float = 0.1, *, current: int | None = None, **changes: object) -> None:
        """Time passes, then one look (none while the link is away)."""
        self.now_s += seconds
        self.state = replace(self.state, **changes)  # type: ignore[arg-type]
        if current is not None:
            self.progress = self.progress.now_current(current)
        if self.state.connected:
            snapshot = VehicleSnapshot(self.state, self.now_s, self.now_s + 1e9, 1.0)
            self.releases = [release.observe(snapshot, self.progress)[0] for release in self.releases]

    def wait(self, seconds: float) -> None:
        """Look ten times a second."""
        for _ in range(round(seconds * 10)):
            self.tick()

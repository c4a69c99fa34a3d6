"""Parts of a vehicle in the air without its flight: each is stepped alone, and place and time are set by hand."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from app.simulator.airframe import AIRFRAMES
from app.simulator.clock import VehicleClock
from app.simulator.commander import Commander, ModeChecks, StatusOutput
from app.simulator.faults import VehicleFaults
from app.simulator.firmware import PROFILES
from app.simulator.geo import LocalFrame
from app.simulator.mission.item import Item
from app.simulator.mission.store import MissionStore, plan_of
from app.simulator.navigator.context import NavContext
from app.simulator.navigator.gimbal import Command
from app.simulator.navigator.mission_mode import MissionResult
from app.simulator.offboard.receiver import CHECK_S, OffboardStream, OffboardTarget
from app.simulator.params import Params, Value
from app.simulator.state import Home, LandDetected, VehicleState
from app.simulator.wire import Mode, Severity, VtolState
from tests.support.simulated_vehicle import Plan

GROUND_AMSL_M = 100.5
FRAME = LocalFrame(47.0, 8.0, GROUND_AMSL_M)
Place = tuple[float, float, float]


class Airborne:
    """Armed and in the air since long ago; `said` and `events` are what a ground station would hear."""

    def __init__(self, airframe: str = "quad", at: Place = (0.0, 0.0, 20.0), **params: Value) -> None:
        spec = AIRFRAMES[airframe]
        self.said: list[str] = []
        self.events: list[tuple[object, ...]] = []
        self.issued: list[Command] = []
        """Commands that the autopilot gives itself."""
        self.params = Params(spec.params, params)
        self.clock = VehicleClock(100.0)
        self.faults = VehicleFaults()
        self.state = VehicleState()
        self.status = self.state.status
        self.store = MissionStore()
        self.result = MissionResult(valid=True)
        self.offboard = OffboardStream(self.params, self.clock)
        self.checks = ModeChecks(self.status, self.params, self.clock, self.result, self.offboard)
        self.commander = Commander(
            self.state,
            self.params,
            self.clock,
            self.result,
            self.offboard,
            self.checks,
            StatusOutput(self.text, self.event),
        )
        self.context = NavContext(
            self.state, self.params, 1, spec, PROFILES["px4-main"], FRAME, self.clock, self.text, self.event,
            self.issued.append,
        )  # fmt: skip
        self.status.home = Home(0.0, 0.0, 0.0)
        self.status.armed = True
        self.status.vtol_state = VtolState.FW if spec.is_vtol else VtolState.UNDEFINED
        self.land(False)
        self.place(*at)

    def text(self, severity: Severity, text: str) -> None:
        self.said.append(text)

    def event(self, name: str, *arguments: object) -> None:
        self.events.append((name, *arguments))

    def place(self, north_m: float, east_m: float, up_m: float) -> None:
        self.state.body.north_m, self.state.body.east_m, self.state.body.up_m = north_m, east_m, up_m

    def land(self, landed: bool = True) -> None:
        self.status.land = LandDetected(ground_contact=landed, maybe_landed=landed, landed=landed)

    def stream_attitude(self) -> None:
        self._stream(OffboardTarget(thrust=0.5))

    def stream_position(self) -> None:
        self._stream(OffboardTarget(position=(0.0, 0.0, 10.0)))

    def _stream(self, target: OffboardTarget) -> None:
        """Until the next check of the stream has seen it."""
        self.offboard.receive(target)
        self.run(self.offboard.step, CHECK_S)

    def upload(self, plans: Sequence[Plan], mission_type: int = 0) -> None:
        items = []
        for plan in plans:
            place = FRAME.to_global(plan.north_m, plan.east_m) if plan.north_m is not None else (0.0, 0.0)
            x, y = (round(degrees * 1e7) for degrees in place)
            frame = 6 if plan.north_m is not None else 2
            items.append(Item(plan.command, frame, plan.autocontinue, *plan.params, x, y, plan.up_m))
        self.store.commit(mission_type, plan_of(items))

    def run(self, step: Callable[[], None], seconds: float = VehicleClock.STEP_S) -> None:
        """Let time pass for one part."""
        end_s = self.clock.now_s + seconds
        while self.clock.now_s < end_s - 1e-6:
            self.clock.advance()
            step()

    def until(self, step: Callable[[], None], condition: Callable[[], bool], limit_s: float = 60.0) -> float:
        """The time that it took, or NaN if it took longer than `limit_s`."""
        start_s = self.clock.now_s
        while self.clock.now_s < start_s + limit_s:
            self.clock.advance()
            step()
            if condition():
                return self.clock.now_s - start_s
        return math.nan

    @property
    def flown(self) -> tuple[Mode, bool]:
        """Mode, and whether a failsafe flies it."""
        return self.status.mode, self.status.failsafe

"""A flight of plans/clinic-run.json that is told what is seen, on a clock of its own, without asyncio."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from app.domain.flight.flight import Flight
from app.domain.flight.inputs import CommandRequested, FlightInput, Observation, Observed, Recovered
from app.domain.flight.step import step
from app.domain.run.run import Run, RunAction, RunState
from app.domain.vehicle.state import FlightMode, LandedState, MissionState, VehicleState
from tests.support.flown_flights import BEGAN_AT, BEGAN_S, MISSION, MISSION_ID, TICK_S, a_flight, a_run

ON_ITS_WAY = VehicleState(
    connected=True,
    mode=FlightMode.MISSION,
    armed=True,
    landed=LandedState.IN_AIR,
    latitude_deg=47.397742,
    longitude_deg=8.545594,
    position_age_s=0.1,
    mission_seq=1,
    mission_id=MISSION_ID,
    mission_state=MissionState.ACTIVE,
)
LAST_SEQ = MISSION.items[-1].seq


@dataclass
class Told:
    """`states` are those of the run, as they follow each other."""

    flight: Flight = field(default_factory=lambda: a_flight(a_run()))
    state: VehicleState = ON_ITS_WAY
    now_s: float = BEGAN_S
    states: list[RunState] = field(default_factory=list)
    has_clock: bool = False
    """Whether the vehicle's own clock is heard, with each position."""

    @property
    def run(self) -> Run:
        return self.flight.run

    @property
    def observed(self) -> Observation:
        boot_time_s = self.now_s - 900.0 if self.has_clock else self.state.boot_time_s
        state = replace(self.state, boot_time_s=boot_time_s)
        return Observation(state, self.now_s, BEGAN_AT + self.now_s - BEGAN_S)

    def feed(self, given: FlightInput) -> None:
        self.flight, _ = step(self.flight, given)
        if self.states[-1:] != [self.run.state]:
            self.states.append(self.run.state)

    def see(self, seconds: float = TICK_S, **changes: object) -> None:
        """The vehicle as it is from now on, for so long."""
        self.state = replace(self.state, **changes)  # type: ignore[arg-type]
        for _ in range(max(1, round(seconds / TICK_S))):
            self.now_s += TICK_S
            self.feed(Observed(self.observed))

    def command(self, action: RunAction) -> None:
        """A user's."""
        self.feed(CommandRequested(self.observed, action))

    def return_at_end(self) -> None:
        """The mission comes to its last item, the return."""
        self.see()
        self.see(mission_seq=LAST_SEQ)
        self.see(3.0, mode=FlightMode.RETURN, mission_state=MissionState.COMPLETE)

    def restart(self) -> None:
        """Another process of the service follows it from now on."""
        self.flight = a_flight(self.run, self.now_s)
        flown = self.run.flown_item_ids
        self.feed(Recovered(self.observed, in_flight=True, flown=flown, current=self.state.mission_seq))

    def touch_down(self) -> None:
        """In the mode in which it is; it disarms later."""
        self.see(2.0, landed=LandedState.ON_GROUND)

    def disarm(self, mode: FlightMode) -> None:
        """PX4 goes back to a mode, and says so before it says that it is disarmed."""
        self.see(0.5, mode=mode, in_failsafe=False)
        self.see(6.0, armed=False)

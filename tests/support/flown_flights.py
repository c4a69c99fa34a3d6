"""A flight of plans/clinic-run.json that answers its commands, on a clock of its own, without asyncio."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

from app.domain.autopilot.declared import default_facts
from app.domain.events import AnyPayload
from app.domain.events.run import RunChanged, RunCommand, RunCommandName
from app.domain.events.run_fold import RunFold
from app.domain.flight.flight import DEFAULT_MAX_OFFSET_M, LOST_AFTER_S, Flight
from app.domain.flight.inputs import (
    ContingencyBegun,
    FactReceived,
    FlightInput,
    Observation,
    Observed,
    RecordEvent,
    Recovered,
    ReleaseAcknowledged,
)
from app.domain.flight.recovery import taken_over
from app.domain.flight.segment import drop_records, segment_of
from app.domain.flight.snapshot import ContingencyCommand, DropCommand, ReleaseCommand, ResumeCommand
from app.domain.flight.step import step
from app.domain.mission import MavCmd
from app.domain.plan import parse_plan
from app.domain.plan.compiler import compile_plan
from app.domain.run.run import Run, RunAction, RunState, TakenOver
from app.domain.vehicle.commands import CommandAck, MavResult
from app.domain.vehicle.facts import ItemReached
from app.domain.vehicle.state import FlightMode, LandedState, MissionState, VehicleState, VehicleType
from tests.support.paths import PLANS

PLAN = parse_plan((PLANS / "clinic-run.json").read_text(encoding="utf-8"))
MISSION = compile_plan(PLAN, default_facts(VehicleType.MULTICOPTER))
DROP = MISSION.drops[0]
MISSION_ID = 7
TICK_S = 0.1
LEG_S = 4.0
"""From one item to the next."""
ACK_S = 0.4
"""From a release to its final ack; the output moves in its middle."""
COMMAND_NAMES = {
    ReleaseCommand: RunCommandName.DO_GRIPPER,
    ResumeCommand: RunCommandName.SET_CURRENT,
    ContingencyCommand: RunCommandName.RETURN,
}
BEGAN_S, BEGAN_AT = 1000.0, 1_700_000_000.0


def a_run() -> Run:
    """The run as its vehicle has just taken off."""
    run = Run(id="r", plan_id="p", plan_hash="h", vehicle_id="v1", created_at=BEGAN_AT, updated_at=BEGAN_AT)
    given = {"state": RunState.FLYING, "mission_id": MISSION_ID, "drops": drop_records(MISSION), "started_at": BEGAN_AT}
    return run.model_copy(update=given)


def a_flight(run: Run, now_s: float = BEGAN_S) -> Flight:
    return Flight.of(
        run, segment_of(run, PLAN, MISSION, DEFAULT_MAX_OFFSET_M, {}), now_s, LOST_AFTER_S, DEFAULT_MAX_OFFSET_M
    )


@dataclass
class Flown:
    """A vehicle and the flight that looks at it. `seen` are all inputs so far, `recorded` all that was recorded."""

    flight: Flight = field(default_factory=lambda: a_flight(a_run()))
    now_s: float = BEGAN_S
    seen: list[FlightInput] = field(default_factory=list)
    recorded: list[AnyPayload] = field(default_factory=lambda: [RunChanged(a_run())])
    commands: list[DropCommand] = field(default_factory=list)
    seq: int = 0
    at_item_s: float = 0.0
    released_s: float | None = None
    attempt: int = 0
    returning: bool = False
    landed: bool = False
    deaths: list[Flown] | None = None
    """If given, every moment of a step at which the process may die is added to it."""

    @property
    def state(self) -> VehicleState:
        """What is seen of the vehicle now."""
        on_way_m = max(0.0, LEG_S - self.at_item_s) * 10.0 if self.seq <= DROP.hold_seqs[0] else 40.0
        holds = self.seq == DROP.hold_seqs[0] and on_way_m == 0.0
        opened = self.released_s is not None and self.now_s - self.released_s > ACK_S / 2
        returns = self.ends
        return VehicleState(
            connected=True,
            mode=FlightMode.RETURN if returns else FlightMode.MISSION,
            armed=not self.landed,
            landed=LandedState.ON_GROUND if self.landed else LandedState.IN_AIR,
            latitude_deg=DROP.latitude_deg - on_way_m / 111_195,
            longitude_deg=DROP.longitude_deg,
            relative_altitude_m=15.0,
            velocity_north_m_s=0.0 if holds else 10.0,
            velocity_east_m_s=0.0,
            position_age_s=0.05,
            boot_time_s=self.now_s - 900.0,
            mission_seq=self.seq,
            mission_id=MISSION_ID,
            mission_state=MissionState.COMPLETE if self.landed and not self.returning else MissionState.ACTIVE,
            has_gripper_output=True,
            gripper_output_us=1000 if opened else 2000,
            gripper_output_age_s=0.05,
        )

    @property
    def ends(self) -> bool:
        """Whether it is on its way back."""
        return self.returning or self.seq == MISSION.items[-1].seq

    @property
    def observed(self) -> Observation:
        return Observation(self.state, self.now_s, BEGAN_AT + self.now_s - BEGAN_S)

    @property
    def run(self) -> Run:
        return self.flight.run

    def feed(self, given: FlightInput) -> None:
        """One input; what it records is stored, then what it commands is carried out.

        A release alone waits for the journal: any other command may leave before anything of its step is stored.
        """
        self.seen.append(given)
        stored = len(self.recorded)
        self.flight, effects = step(self.flight, given)
        self.recorded += [effect.payload for effect in effects if isinstance(effect, RecordEvent)]
        if effects:
            for count in range(stored, len(self.recorded) + 1):
                self.may_die(count)
        for effect in effects:
            if not isinstance(effect, RecordEvent):
                self.commands.append(effect)
                self.recorded.append(RunCommand(command=COMMAND_NAMES[type(effect)]))
                self.may_die(len(self.recorded))
                self.carry_out(effect)
                earliest = len(self.recorded) if isinstance(effect, ReleaseCommand) else stored
                for count in range(earliest, len(self.recorded) + 1):
                    self.may_die(count)

    def carry_out(self, command: DropCommand) -> None:
        """The vehicle does what it is told."""
        match command:
            case ReleaseCommand(attempt=attempt):
                self.released_s, self.attempt = self.now_s, attempt
            case ResumeCommand(seq=seq):
                self.go_on(seq)
            case ContingencyCommand(action="return"):
                self.returning, self.at_item_s = True, 0.0
                self.feed(ContingencyBegun(self.observed, RunAction.CONTINGENCY))
            case _:
                raise AssertionError(f"not in this flight: {command}")

    def may_die(self, count: int) -> None:
        """Here the process may be killed, with so many events in the journal."""
        if self.deaths is not None:
            self.deaths.append(replace(self, recorded=self.recorded[:count], deaths=None))

    def go_on(self, seq: int) -> None:
        self.seq, self.at_item_s = seq, 0.0

    def tick(self) -> None:
        """A tenth of a second: the vehicle flies, answers, and is looked at."""
        for given in self.flown_on():
            self.feed(given)
        self.feed(Observed(self.observed))

    def flown_on(self) -> list[FlightInput]:
        """A tenth of a second of the vehicle's, and what it tells in it."""
        self.now_s, self.at_item_s = self.now_s + TICK_S, self.at_item_s + TICK_S
        recorded: list[FlightInput] = []
        if self.attempt and self.released_s is not None and self.now_s - self.released_s > ACK_S:
            attempt, self.attempt = self.attempt, 0
            ack = CommandAck(MavCmd.DO_GRIPPER, MavResult.ACCEPTED)
            recorded.append(ReleaseAcknowledged(self.observed, self.run.changes, DROP.plan_item_id, attempt, ack))
        hold_s = DROP.hold_s if self.seq == DROP.hold_seqs[0] else 0.0
        if self.at_item_s > LEG_S + hold_s and not self.ends:
            recorded.append(FactReceived(self.observed, ItemReached(self.seq)))
            self.go_on(self.seq + 1)
        self.landed = self.landed or (self.ends and self.at_item_s > LEG_S)
        return recorded

    def to_the_end(self) -> Run:
        """Until the run is over."""
        while not self.run.is_over:
            assert self.now_s < BEGAN_S + 200.0, "the run must end"
            self.tick()
        return self.run

    def restarted(self, down_s: float) -> Flown:
        """Killed now for so long: what was stored is folded, what came meanwhile is lost, the vehicle flies on."""
        return self._followed_by(self._told(len(self.recorded)), down_s, lambda run, _: run)

    def taken_over(self, down_s: float, untold: int) -> Flown:
        """Killed now, and taken over by another gateway so long after it, which never learns of the last events."""
        taken = TakenOver(gateway="gw-2", from_gateway="gw-1", number=1, at=BEGAN_AT)
        told = self._told(max(1, len(self.recorded) - untold)).model_copy(update={"taken_over": taken})
        return self._followed_by(told, down_s, lambda run, state: taken_over(run, MISSION, state))

    def _told(self, count: int) -> Run:
        """The run as so many events tell of it."""
        fold = RunFold()
        for payload in self.recorded[:count]:
            fold.take(payload)
        run = fold.run()
        assert run is not None
        return run

    def _followed_by(self, run: Run, down_s: float, found: Callable[[Run, VehicleState], Run]) -> Flown:
        again = replace(self, attempt=0, seen=[], recorded=[*self.recorded], commands=[], deaths=None)
        for _ in range(round(down_s / TICK_S)):
            again.flown_on()
        run = found(run, again.state)
        again.flight = a_flight(run, again.now_s)
        again.feed(Recovered(again.observed, in_flight=True, flown=run.flown_item_ids, current=again.state.mission_seq))
        return again


def deaths(flown: Flown) -> list[Flown]:
    """The flight at every moment between two events of its journal, and between a command's event and its effect."""
    flown.deaths = []
    flown.to_the_end()
    return flown.deaths


def prefixes(flown: Flown) -> Iterator[Flown]:
    """The flight after each look, until its end."""
    while not flown.run.is_over:
        yield replace(flown, seen=[*flown.seen], recorded=[*flown.recorded], commands=[*flown.commands])
        flown.tick()

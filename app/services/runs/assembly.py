"""Puts one flight together from a run, its plan and its vehicle."""

from __future__ import annotations

from dataclasses import dataclass

from app.domain.flight.flight import Flight
from app.domain.flight.leg import leg_of
from app.domain.flight.log_port import FlightLog
from app.domain.mission import Mission
from app.domain.plan import Gripper, Plan
from app.domain.ports import VehicleLink
from app.domain.prediction import CALM
from app.domain.run import Run
from app.domain.vehicle import VehicleFacts
from app.services.clock import Clock
from app.services.journal import Journal
from app.services.runs.changing import MissionChanger
from app.services.runs.consents import Consents
from app.services.runs.flight import RunFlight
from app.services.runs.logbook import FlightLogbook
from app.services.runs.plan_gate import FactsRead, refuse_changed_vehicle
from app.services.runs.prepare import Preparation
from app.services.runs.rally_return import RallyReturn
from app.services.runs.recorder import RunRecorder
from app.services.runs.sending import OrderSender
from app.services.runs.settings import RunSettings
from app.services.runs.watch import FlightWatch
from app.services.targets import Targets


@dataclass(frozen=True, slots=True)
class Assembled:
    """A flight and the parts that its owner still needs."""

    flight: RunFlight
    recorder: RunRecorder
    watch: FlightWatch


def assemble(
    run: Run,
    plan: Plan,
    mission: Mission,
    link: VehicleLink,
    then: VehicleFacts,
    facts: FactsRead,
    journal: Journal,
    settings: RunSettings,
    clock: Clock,
    targets: Targets,
    log: FlightLog,
) -> Assembled:
    """One flight, ready to `fly`. `then`: what the mission was compiled for; `facts` reads what is now."""
    recorder = RunRecorder(run, journal, clock)
    leg = leg_of(run, plan, mission, settings.default_max_offset_m)
    now_s = clock.monotonic()
    flown = Flight.of(run, leg, now_s, settings.lost_after_s, settings.default_max_offset_m)
    watch = FlightWatch(link, flown, recorder, clock, targets, FlightLogbook(log, flown))

    async def check() -> None:
        now, uploaded = await facts(fresh=True), link.mission_id_of(mission)
        await refuse_changed_vehicle(plan, then.home, now, run.wind or CALM, link.mission_id_of, uploaded)

    loaded = _starts_loaded(plan)
    preparation = Preparation(link, mission, recorder, settings, clock, check, closes_gripper=loaded)
    changer = MissionChanger(link, facts, recorder, watch, settings, clock)
    sender = OrderSender(link, recorder, watch, settings, changer.break_off)
    consents = Consents(watch, recorder)
    rally_return = RallyReturn(link, watch)
    flight = RunFlight(link, recorder, preparation, watch, sender, consents, changer, rally_return, settings)
    return Assembled(flight, recorder, watch)


def _starts_loaded(plan: Plan) -> bool:
    """Whether the first thing that the gripper does is a release: the parcel is on board from the start."""
    first = next((item for item in plan.items if isinstance(item, Gripper)), None)
    return first is not None and first.lets_go

"""What a flight is put together from, and how."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from app.domain.flight.flight import Flight
from app.domain.flight.segment import segment_of
from app.domain.items import Gripper
from app.domain.mission import Mission
from app.domain.plan import Plan
from app.domain.plan.intercept import approach_speeds_m_s
from app.domain.ports.stores import FlightLog
from app.domain.ports.threads import InThread
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.prediction import CALM
from app.domain.rules import Finding
from app.domain.run.run import Run
from app.domain.vehicle.state import VehicleProfile
from app.services.clock import Clock
from app.services.journal import Journal
from app.services.plans import Plans
from app.services.runs.changing import MissionChanger
from app.services.runs.commands import FlightCommandSender
from app.services.runs.disarming import EndDisarming
from app.services.runs.flight import RunFlight
from app.services.runs.gated_link import GatedLink
from app.services.runs.gates import FactsRead, refuse_changed_vehicle
from app.services.runs.monitor import FlightMonitor
from app.services.runs.prepare import Preparation
from app.services.runs.recorder import FlightInputLog, RunRecorder
from app.services.runs.settings import RunSettings
from app.services.targets import Targets


@dataclass(frozen=True, slots=True)
class FlightParts:
    """What every flight is put together from. `log` keeps its inputs. `may_command`: see Fleet."""

    journal: Journal
    settings: RunSettings
    clock: Clock
    targets: Targets
    plans: Plans
    log: FlightLog
    may_command: Callable[[str], bool]
    in_thread: InThread


@dataclass(frozen=True, slots=True)
class AssembledFlight:
    """A flight and the parts that its owner still needs."""

    flight: RunFlight
    recorder: RunRecorder
    monitor: FlightMonitor


def begun_flight(
    run: Run, plan: Plan, mission: Mission, then: VehicleProfile, settings: RunSettings, now_s: float
) -> Flight:
    """The flight before its first input. `then`: what the mission was compiled for."""
    speeds = approach_speeds_m_s(plan, then)
    segment = segment_of(run, plan, mission, settings.default_max_offset_m, speeds)
    return Flight.of(run, segment, now_s, settings.lost_after_s, settings.default_max_offset_m)


def assemble(
    run: Run,
    plan: Plan,
    mission: Mission,
    link: VehicleLink,
    then: VehicleProfile,
    facts: FactsRead,
    parts: FlightParts,
) -> AssembledFlight:
    """One flight, ready to `fly`. `then`: what the mission was compiled for; `facts` reads what is now."""
    settings, clock, in_thread = parts.settings, parts.clock, parts.in_thread
    may_command = partial(parts.may_command, run.id)
    link = GatedLink.of(link, may_command)
    recorder = RunRecorder(run, parts.journal, clock)
    begun = begun_flight(run, plan, mission, then, settings, clock.monotonic())
    monitor = FlightMonitor(link, begun, recorder, clock, parts.targets, FlightInputLog(parts.log, begun, in_thread))

    async def check() -> Sequence[Finding]:
        now, uploaded = await facts(fresh=True), link.mission_id_of(mission)
        wind = run.wind or CALM
        return await refuse_changed_vehicle(plan, then, now, wind, link.mission_id_of, uploaded, in_thread)

    loaded = _starts_loaded(plan)
    preparation = Preparation(link, mission, recorder, monitor, settings, clock, check, closes_gripper=loaded)
    changer = MissionChanger(link, facts, recorder, monitor, settings, clock, in_thread)
    sender = FlightCommandSender(link, recorder, monitor, changer, parts.plans, settings, may_command)
    monitor.hand_commands_to(sender.carry_out)
    disarming = EndDisarming(link, recorder, monitor, may_command)
    flight = RunFlight(link, recorder, preparation, monitor, sender, changer, disarming, settings)
    return AssembledFlight(flight, recorder, monitor)


def _starts_loaded(plan: Plan) -> bool:
    """Whether the first thing that the gripper does is a release: the parcel is on board from the start."""
    first = next((item for item in plan.items if isinstance(item, Gripper)), None)
    return first is not None and first.releases

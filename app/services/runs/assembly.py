"""Puts one flight together from a run, its plan and its vehicle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.domain.consent import ConsentRecord
from app.domain.drop import DropRecord
from app.domain.gripper_turns import GripperTurns
from app.domain.mission import CompiledDrop, Mission
from app.domain.plan import Gripper, Plan, Winch
from app.domain.ports import VehicleLink
from app.domain.run import IN_FLIGHT, Run, RunState
from app.services.clock import Clock
from app.services.journal import Journal
from app.services.runs.consents import Consents
from app.services.runs.embedded_release import EmbeddedRelease
from app.services.runs.flight import RunFlight
from app.services.runs.orders import Release
from app.services.runs.prepare import Preparation
from app.services.runs.recorder import RunRecorder
from app.services.runs.sending import OrderSender
from app.services.runs.settings import RunSettings
from app.services.runs.supervised_release import SupervisedRelease
from app.services.runs.watch import FlightWatch

NOT_STARTED: Final = frozenset({RunState.CREATED, RunState.UPLOADING, RunState.UPLOADED})


@dataclass(frozen=True, slots=True)
class Assembled:
    """A flight and the parts that its owner still needs."""

    flight: RunFlight
    recorder: RunRecorder
    watch: FlightWatch


def drop_records(mission: Mission) -> tuple[DropRecord, ...]:
    """The records of a mission's drops before the flight."""
    return tuple([_new_record(drop) for drop in mission.drops])


def _new_record(drop: CompiledDrop, alternate_to: str | None = None) -> DropRecord:
    return DropRecord(
        plan_item_id=drop.plan_item_id,
        supervised=drop.supervised,
        alternate_to=alternate_to,
        consent=ConsentRecord() if drop.needs_consent else None,
        planned_latitude_deg=drop.latitude_deg,
        planned_longitude_deg=drop.longitude_deg,
    )


def assemble(
    run: Run, plan: Plan, mission: Mission, link: VehicleLink, journal: Journal, settings: RunSettings, clock: Clock
) -> Assembled:
    """One flight, ready to `fly`."""
    recorder = RunRecorder(run, journal, clock)
    releases = _releases(run, plan, mission, settings)
    alternates = _alternates(run, plan, mission, settings)
    watch = FlightWatch(link, mission, plan.vehicle_type, releases, alternates, recorder, settings, clock)
    preparation = Preparation(link, mission, recorder, settings, clock, closes_gripper=_starts_loaded(plan))
    sender = OrderSender(link, recorder, watch, settings)
    asking = [*releases, *alternates.values()]
    consents = Consents([r for r in asking if isinstance(r, SupervisedRelease)], watch, recorder)
    flight = RunFlight(link, recorder, preparation, watch, sender, consents, settings)
    return Assembled(flight, recorder, watch)


def _starts_loaded(plan: Plan) -> bool:
    """Whether the first thing that the gripper does is a release: the parcel is on board from the start."""
    first = next((item for item in plan.items if isinstance(item, Gripper)), None)
    return first is not None and first.action == "release"


def _releases(run: Run, plan: Plan, mission: Mission, settings: RunSettings) -> tuple[Release, ...]:
    offsets = {item.id: item.max_offset_m for item in plan.items if isinstance(item, Gripper | Winch)}
    made: list[Release] = []
    waited_at_s = run.updated_at if run.state in IN_FLIGHT else None
    on_failure = plan.contingency.on_drop_failure
    for drop in mission.drops:
        record = run.drop(drop.plan_item_id)
        if drop.supervised:
            offset_m = offsets.get(drop.plan_item_id) or settings.default_max_offset_m
            made.append(SupervisedRelease(drop, record, offset_m, on_failure, waited_at_s))
        else:
            turns, taken_up = GripperTurns.of(drop, mission), run.state not in NOT_STARTED
            made.append(EmbeddedRelease(drop, record, on_failure, turns, taken_up=taken_up))
    return tuple(made)


def _alternates(run: Run, plan: Plan, mission: Mission, settings: RunSettings) -> dict[str, SupervisedRelease]:
    """The drop at each alternate, by the drop that must fail before; one that was begun already goes on."""
    offsets = {alternate.id: alternate.max_offset_m for _, alternate in plan.alternates}
    begun = {record.plan_item_id: record for record in run.drops}
    made: dict[str, SupervisedRelease] = {}
    for drop in mission.drops:
        if drop.alternate is None:
            continue
        name = drop.alternate.plan_item_id
        record = begun.get(name)
        waited_at_s = run.updated_at if record is not None and run.state in IN_FLIGHT else None
        record = record or _new_record(drop.alternate, alternate_to=drop.plan_item_id)
        offset_m = offsets.get(name) or settings.default_max_offset_m
        on_failure = plan.contingency.on_drop_failure
        made[drop.plan_item_id] = SupervisedRelease(drop.alternate, record, offset_m, on_failure, waited_at_s)
    return made

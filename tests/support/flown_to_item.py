"""A flight of plans/multicopter-embedded.json, or of another plan, on its way to one of its items."""

from __future__ import annotations

from dataclasses import replace

from app.domain.autopilot.declared import default_facts
from app.domain.flight.flight import DEFAULT_MAX_OFFSET_M, LOST_AFTER_S, Flight
from app.domain.flight.inputs import FactReceived, Observation, Observed
from app.domain.flight.segment import drop_records, segment_of
from app.domain.flight.step import step
from app.domain.mission import Mission
from app.domain.plan import Plan, parse_plan
from app.domain.plan.compiler import compile_plan
from app.domain.vehicle.facts import MissionCurrent
from app.domain.vehicle.state import VehicleType
from tests.support.flown_flights import BEGAN_S, MISSION_ID, Flown, a_run
from tests.support.paths import PLANS

PLAN = parse_plan((PLANS / "multicopter-embedded.json").read_text(encoding="utf-8"))
MISSION = compile_plan(PLAN, default_facts(VehicleType.MULTICOPTER))
DROP = MISSION.drops[0]
FAR = 0
APPROACH = min(DROP.hold_seqs)


def flown_to(seq: int, plan: Plan = PLAN, mission: Mission = MISSION) -> tuple[Flight, Observation]:
    """A flight whose vehicle is in the air, on its way to this item."""
    run = a_run().model_copy(update={"drops": drop_records(mission)})
    segment = segment_of(run, plan, mission, DEFAULT_MAX_OFFSET_M, {})
    flight = Flight.of(run, segment, BEGAN_S, LOST_AFTER_S, DEFAULT_MAX_OFFSET_M)
    seen = Flown().observed
    seen = replace(seen, state=replace(seen.state, mission_seq=seq))
    for given in (Observed(seen), FactReceived(seen, MissionCurrent(seq, mission_id=MISSION_ID)), Observed(seen)):
        flight, _ = step(flight, given)
    assert flight.progress.current == seq
    return flight, seen

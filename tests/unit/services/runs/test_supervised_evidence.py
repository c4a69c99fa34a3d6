"""A supervised drop's record notes the gripper's output only as evidence of its own release."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.compiler import compile_plan
from app.domain.default_facts import default_facts
from app.domain.drop import DropPhase, DropRecord
from app.domain.mission import CompiledDrop, MavCmd
from app.domain.plan import parse_plan
from app.domain.progress import Progress
from app.domain.vehicle import FlightMode, VehicleState, VehicleType
from app.services.runs.evidence import Look
from app.services.runs.supervised_release import SupervisedRelease
from tests.unit.services.runs.desk import PLANS

MISSION = compile_plan(parse_plan((PLANS / "clinic-run.json").read_text()), default_facts(VehicleType.MULTICOPTER))
DROP = MISSION.drops[0]
COMMANDED_AT_S = 5000.0


def looked_at(
    age_s: float, *, after_s: float = 10.0, output_us: int = 1000, compiled: CompiledDrop = DROP
) -> DropRecord:
    """The record after one look, that much later than the release was commanded."""
    record = DropRecord(
        plan_item_id=compiled.plan_item_id,
        supervised=True,
        phase=DropPhase.RELEASING,
        attempts=1,
        commanded_at=COMMANDED_AT_S,
    )
    release = SupervisedRelease(compiled, record, 2.0, "continue")
    state = VehicleState(
        connected=True,
        mode=FlightMode.MISSION,
        mission_seq=2,
        boot_time_s=60.0,
        position_age_s=0.1,
        gripper_output_us=1000,
        gripper_output_age_s=age_s,
    )
    release.look(Look(state, 100.0, COMMANDED_AT_S + after_s, 1.0), Progress.of(MISSION))
    return release.record


def test_the_output_is_noted_with_the_time_at_which_it_was_received() -> None:
    record = looked_at(1.5)
    assert (record.output_us, record.output_at) == (1000, pytest.approx(COMMANDED_AT_S + 8.5))


@pytest.mark.parametrize(("age_s", "after_s"), [(9.0, 10.0), (1.5, 1.0)])
def test_an_output_that_is_old_or_from_before_the_release_is_no_evidence(age_s: float, after_s: float) -> None:
    record = looked_at(age_s, after_s=after_s)
    assert (record.output_us, record.output_at) == (None, None)


def test_a_winch_is_not_given_the_output_of_the_gripper() -> None:
    record = looked_at(0.1, compiled=replace(DROP, command=MavCmd.DO_WINCH))
    assert record.output_us is None

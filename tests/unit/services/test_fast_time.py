"""Which speeds of the simulated time stand against what is decided by our clock right now."""

from __future__ import annotations

import pytest

from app.domain.drop.record import DropPhase, DropRecord
from app.domain.errors import SimulatorRefusedError
from app.domain.run.run import PlanChange, Run, RunState
from app.services.simulation import refuse_unsafe_speed


def run(state: RunState, *, supervised: bool = True, phase: DropPhase = DropPhase.WAITING) -> Run:
    drop = DropRecord(plan_item_id="drop", supervised=supervised, phase=phase)
    times = {"created_at": 0.0, "updated_at": 0.0}
    return Run(id="r-1", plan_id="p", plan_hash="h", vehicle_id="v1", state=state, drops=(drop,), **times)


@pytest.mark.parametrize(
    ("one", "speed"),
    [
        (run(RunState.STARTING), 4.1),
        (run(RunState.FLYING), 50.0),
        (run(RunState.PAUSED), 4.1),
        (run(RunState.RETURNING), 4.1),
        (run(RunState.AT_DROP), 1.0),
        (run(RunState.AT_DROP, phase=DropPhase.RELEASING), 4.0),
    ],
)
def test_refused(one: Run, speed: float) -> None:
    with pytest.raises(SimulatorRefusedError, match="run r-1"):
        refuse_unsafe_speed(speed, [one], [])


@pytest.mark.parametrize("speed", [4.0, 4.1, 50.0])
def test_while_a_mission_is_changed_that_may_bring_a_supervised_drop(speed: float) -> None:
    changing = PlanChange.model_construct(plan_id="p-2")
    one = run(RunState.FLYING, supervised=False).model_copy(update={"changing": changing})
    if speed <= 4.0:
        refuse_unsafe_speed(speed, [one], [])
        return
    with pytest.raises(SimulatorRefusedError, match="being changed"):
        refuse_unsafe_speed(speed, [one], [])


@pytest.mark.parametrize(
    ("one", "speed"),
    [
        (run(RunState.FLYING), 4.0),
        (run(RunState.UPLOADED), 50.0),
        (run(RunState.FLYING, phase=DropPhase.DONE), 50.0),
        (run(RunState.FLYING, supervised=False), 50.0),
        (run(RunState.AT_DROP, supervised=False), 50.0),
    ],
)
def test_taken(one: Run, speed: float) -> None:
    refuse_unsafe_speed(speed, [one], [])

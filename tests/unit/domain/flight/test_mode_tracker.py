"""Who commanded a mode is known only when what would tell of it has had its time."""

from __future__ import annotations

from itertools import permutations

import pytest

from app.domain.flight.modes import CAUSE_REPORTED_S, ModeTracker
from app.domain.flight.phase import PhaseFacts, phase_of
from app.domain.reasons import Reason, describe
from app.domain.run.run import RunState
from app.domain.vehicle.state import FlightMode, LandedState, VehicleState, VehicleType


def phase(state: VehicleState, sign: ModeTracker, now_s: float, **more: bool) -> tuple[RunState, Reason | None]:
    """The phase at a look, with nothing asked for."""
    view = PhaseFacts(
        state=state,
        vehicle_type=VehicleType.MULTICOPTER,
        at_drop=False,
        mission_done=more.get("mission_done", False),
        was_airborne=True,
        commanded=None,
        at_last_item=more.get("at_last_item", False),
        mode_is_settled=sign.is_settled(now_s),
        by_failsafe=sign.by_failsafe,
    )
    return phase_of(view)


@pytest.mark.parametrize("mode", [FlightMode.RETURN, FlightMode.HOLD, FlightMode.POSITION])
@pytest.mark.parametrize("order", list(permutations(("mode", "failsafe"))))
def test_a_failsafe_is_nobody_else_whichever_is_seen_first_and_though_it_ends(
    mode: FlightMode, order: tuple[str, ...]
) -> None:
    seen = {"mode": FlightMode.MISSION, "failsafe": False}
    sign, said = ModeTracker(), []
    for at_s, what in enumerate((*order, "ended"), start=1):
        seen |= {"mode": {"mode": mode}, "failsafe": {"failsafe": True}, "ended": {"failsafe": False}}[what]
        state = VehicleState(connected=True, mode=seen["mode"], armed=True, in_failsafe=bool(seen["failsafe"]))
        sign = sign.seen(state, float(at_s))
        said.append(describe(phase(state, sign, float(at_s))[1]))
    assert not [one for one in said if "another client or pilot" in one], said
    assert "a failsafe is active" in said[-1]


def test_it_was_somebody_else_when_nothing_else_was_told_in_time() -> None:
    for mode in (FlightMode.RETURN, FlightMode.HOLD, FlightMode.POSITION):
        state = VehicleState(connected=True, mode=mode, armed=True)
        sign = ModeTracker().seen(state, 1.0).seen(state, 1.5)
        assert "another client or pilot" not in describe(phase(state, sign, 1.5)[1])
        assert "another client or pilot" in describe(phase(state, sign, 1.1 + CAUSE_REPORTED_S)[1])


def test_a_mission_that_ends_in_hold_is_not_paused_before_it_says_complete() -> None:
    """The mode comes at once or with a HEARTBEAT, "complete" with MISSION_CURRENT: up to a second apart."""
    state = VehicleState(connected=True, mode=FlightMode.HOLD, armed=True, landed=LandedState.IN_AIR)
    sign = ModeTracker().seen(state, 1.0)
    assert phase(state, sign, 1.9, at_last_item=True) == (RunState.FLYING, None)
    assert phase(state, sign, 1.9, at_last_item=True, mission_done=True)[0] is RunState.FLYING
    assert phase(state, sign, 1.1 + CAUSE_REPORTED_S, at_last_item=True)[0] is RunState.PAUSED

"""The laws of the reducer, whatever a vehicle, a link, an operator and a client do, in whatever order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

from hypothesis import strategies as st

from app.domain.flight.inputs import (
    CommandFailed,
    CommandRequested,
    FactReceived,
    FlightInput,
    Observation,
    Observed,
    ReleaseAcknowledged,
    ReleaseNotSent,
    ReleaseUnanswered,
    RunEnded,
)
from app.domain.mission import MavCmd
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunAction, RunState
from app.domain.vehicle.commands import CommandAck, MavResult
from app.domain.vehicle.facts import ItemReached, MissionCurrent, Rebooted
from app.domain.vehicle.state import FlightMode, LandedState, VehicleState
from tests.support.flown_flights import BEGAN_AT, BEGAN_S, DROP, MISSION_ID

SEQS = st.integers(-1, 5)


def mixed(**values: Sequence[Any]) -> st.SearchStrategy[dict[str, Any]]:
    """Fields that are drawn at once: ten times as fast as each by itself, and as likely."""
    return st.sampled_from([dict(zip(values, one, strict=True)) for one in product(*values.values())])


LINKS = mixed(
    connected=[True, True, True, False],
    armed=[True, True, True, False, None],
    landed=[LandedState.IN_AIR, LandedState.IN_AIR, *LandedState],
    in_failsafe=[False, False, False, True],
)
MISSIONS = mixed(
    mode=[FlightMode.MISSION] * 4 + [None, *FlightMode],
    mission_seq=[None, 0, 1, 2, 2, 2, 3],
    mission_id=[MISSION_ID, MISSION_ID, 8, None],
)
PLACES = mixed(
    latitude_deg=[DROP.latitude_deg, DROP.latitude_deg, DROP.latitude_deg - 0.001, None],
    relative_altitude_m=[15.0, 15.0, 15.0, 15.0, 30.0, None],
    velocity_north_m_s=[0.0, 0.0, 9.0, None],
    position_age_s=[0.1, 0.1, 9.0, None],
)
OUTPUTS = mixed(gripper_output_us=[None, 900, 1000, 2000, 2000], gripper_output_age_s=[None, 0.1, 9.0])
BOOT_TIMES_S = st.floats(0.0, 60.0)
ACKS = st.builds(CommandAck, st.just(MavCmd.DO_GRIPPER), st.sampled_from(MavResult))
ATTEMPTS = st.integers(1, 4)
ACTIONS = st.sampled_from(RunAction)
ELAPSED_S = st.sampled_from([0.1, 0.1, 0.5, 1.0, 3.0])


@st.composite
def inputs(draw: st.DrawFn) -> list[FlightInput]:
    """Anything, in any order; most of it looks."""
    now_s, given = BEGAN_S, []
    for _ in range(draw(st.integers(1, 40))):
        now_s += draw(ELAPSED_S)
        observed = Observation(state(draw), now_s, BEGAN_AT + now_s - BEGAN_S)
        given.append(draw(KINDS)(draw, observed))
    return given


CHANGES = st.sampled_from(
    [
        *[{}] * 12,
        {"gripper_output_us": 1000},
        {"connected": False},
        {"mode": FlightMode.HOLD},
        {"in_failsafe": True},
        {"armed": False},
        {"position_age_s": 9.0},
        {"velocity_north_m_s": 9.0},
        {"mission_seq": 3},
    ]
)
FIRST = (0, DROP.plan_item_id, 1)
ACCEPTED = CommandAck(MavCmd.DO_GRIPPER, MavResult.ACCEPTED)
ANSWERS: st.SearchStrategy[Callable[[st.DrawFn, Observation], FlightInput]] = st.sampled_from(
    [
        *[lambda _, observed: Observed(observed)] * 4,
        lambda _, observed: ReleaseAcknowledged(observed, *FIRST, ACCEPTED),
        lambda draw, observed: ReleaseAcknowledged(observed, *about(draw), draw(ACKS)),
        lambda draw, observed: ReleaseUnanswered(observed, *about(draw)),
        lambda draw, observed: ReleaseNotSent(observed, *about(draw)),
    ]
)


@st.composite
def inputs_after(draw: st.DrawFn, seen: Observation) -> list[FlightInput]:
    """As `inputs`, from there on: the vehicle mostly stays as it was, and its clock goes on."""
    assert seen.state.boot_time_s is not None
    since_s, given = 0.0, []
    for _ in range(draw(st.integers(1, 40))):
        since_s += draw(ELAPSED_S)
        now = replace(seen.state, boot_time_s=seen.state.boot_time_s + since_s, **draw(CHANGES))
        observed = Observation(now, seen.now_s + since_s, seen.time_s + since_s)
        given.append(draw(draw(st.sampled_from([ANSWERS, ANSWERS, KINDS])))(draw, observed))
    return given


def state(draw: st.DrawFn) -> VehicleState:
    drawn = draw(LINKS) | draw(MISSIONS) | draw(PLACES) | draw(OUTPUTS)
    known = {"longitude_deg": DROP.longitude_deg, "velocity_east_m_s": 0.0}
    return VehicleState(**drawn, **known, boot_time_s=draw(BOOT_TIMES_S))


def about(draw: st.DrawFn) -> tuple[int, str, int]:
    return 0, DROP.plan_item_id, draw(ATTEMPTS)


KINDS: st.SearchStrategy[Callable[[st.DrawFn, Observation], FlightInput]] = st.sampled_from(
    [
        *[lambda _, observed: Observed(observed)] * 6,
        lambda draw, observed: FactReceived(observed, ItemReached(draw(SEQS))),
        lambda draw, observed: FactReceived(observed, MissionCurrent(draw(SEQS), mission_id=MISSION_ID)),
        lambda _, observed: FactReceived(observed, Rebooted()),
        lambda draw, observed: ReleaseAcknowledged(observed, *about(draw), draw(ACKS)),
        lambda draw, observed: ReleaseUnanswered(observed, *about(draw)),
        lambda draw, observed: ReleaseNotSent(observed, *about(draw)),
        lambda draw, observed: CommandRequested(observed, draw(ACTIONS)),
        lambda draw, observed: CommandFailed(observed, draw(ACTIONS), None),
        lambda _, observed: RunEnded(observed, RunState.FAILED, Reason.of(ReasonCode.NOT_TAKEN_OFF)),
    ]
)

"""The laws of the reducer, whatever a vehicle, a link, an operator and a client do, in whatever order."""

from __future__ import annotations

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
STATES = st.builds(
    VehicleState,
    connected=st.sampled_from([True, True, True, False]),
    mode=st.sampled_from([FlightMode.MISSION] * 4 + [None, *FlightMode]),
    armed=st.sampled_from([True, True, True, False, None]),
    landed=st.sampled_from([LandedState.IN_AIR, LandedState.IN_AIR, *LandedState]),
    in_failsafe=st.sampled_from([False, False, False, True]),
    latitude_deg=st.sampled_from([DROP.latitude_deg, DROP.latitude_deg, DROP.latitude_deg - 0.001, None]),
    longitude_deg=st.just(DROP.longitude_deg),
    relative_altitude_m=st.sampled_from([15.0, 15.0, 15.0, 15.0, 30.0, None]),
    velocity_north_m_s=st.sampled_from([0.0, 0.0, 9.0, None]),
    velocity_east_m_s=st.just(0.0),
    position_age_s=st.sampled_from([0.1, 0.1, 9.0, None]),
    boot_time_s=st.floats(0.0, 60.0),
    mission_seq=st.sampled_from([None, 0, 1, 2, 2, 2, 3]),
    mission_id=st.sampled_from([MISSION_ID, MISSION_ID, 8, None]),
    gripper_output_us=st.sampled_from([None, 900, 1000, 2000, 2000]),
    gripper_output_age_s=st.sampled_from([None, 0.1, 9.0]),
)
ACKS = st.builds(CommandAck, st.just(MavCmd.DO_GRIPPER), st.sampled_from(MavResult))
ATTEMPTS = st.integers(1, 4)


@st.composite
def inputs(draw: st.DrawFn) -> list[FlightInput]:
    """Anything, in any order; most of it looks."""
    now_s, given = BEGAN_S, []
    for _ in range(draw(st.integers(1, 40))):
        now_s += draw(st.sampled_from([0.1, 0.1, 0.5, 1.0, 3.0]))
        observed = Observation(draw(STATES), now_s, BEGAN_AT + now_s - BEGAN_S)
        about = (0, DROP.plan_item_id, draw(ATTEMPTS))
        rare = others(observed, draw(SEQS), about, draw(ACKS), draw(st.sampled_from(RunAction)))
        one: FlightInput = draw(st.sampled_from([*[Observed(observed)] * 6, *rare]))
        given.append(one)
    return given


def others(
    observed: Observation, seq: int, about: tuple[int, str, int], ack: CommandAck, asked: RunAction
) -> list[FlightInput]:
    return [
        FactReceived(observed, ItemReached(seq)),
        FactReceived(observed, MissionCurrent(seq, mission_id=MISSION_ID)),
        FactReceived(observed, Rebooted()),
        ReleaseAcknowledged(observed, *about, ack),
        ReleaseUnanswered(observed, *about),
        ReleaseNotSent(observed, *about),
        CommandRequested(observed, asked),
        CommandFailed(observed, asked, None),
        RunEnded(observed, RunState.FAILED, Reason.of(ReasonCode.NOT_TAKEN_OFF)),
    ]

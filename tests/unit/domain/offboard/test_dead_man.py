"""The dead-man's stages and the parameter audit."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.domain.autopilot import autopilot
from app.domain.autopilot.base import Audit
from app.domain.autopilot.capability import FlightKind
from app.domain.offboard.step import DeadMan, Silence

ages = st.floats(0, 10)
AUDIT = autopilot().audit
SAFE = {"COM_OBL_RC_ACT": 5, "COM_OF_LOSS_T": 1.0, "COM_RC_IN_MODE": 4}


@settings(deadline=None)
@given(age_s=ages, kind=st.sampled_from(FlightKind))
def test_a_setpoint_older_than_its_age_is_never_sent(age_s: float, kind: FlightKind) -> None:
    assert (DeadMan().judge(age_s, kind) is Silence.SPEAKS) == (age_s <= 0.4)


@settings(deadline=None)
@given(first=ages, second=ages, kind=st.sampled_from(FlightKind))
def test_silence_only_grows_worse(first: float, second: float, kind: FlightKind) -> None:
    order = list(Silence)
    early, late = sorted((first, second))
    assert order.index(DeadMan().judge(early, kind)) <= order.index(DeadMan().judge(late, kind))


@pytest.mark.parametrize(
    ("kind", "stage"),
    [
        (FlightKind.ROTARY, Silence.SILENT),
        (FlightKind.ROVER, Silence.SILENT),
        (FlightKind.WING, Silence.GONE),
        (FlightKind.AIRSHIP, Silence.GONE),
    ],
)
def test_what_can_stand_still_stands_first_and_a_wing_holds_at_once(kind: FlightKind, stage: Silence) -> None:
    assert DeadMan().judge(0.5, kind) is stage
    assert DeadMan().judge(1.0, kind) is Silence.GONE


def test_without_an_estimate_nothing_can_stand_still() -> None:
    assert DeadMan().judge(0.5, FlightKind.ROTARY, has_estimate=False) is Silence.GONE


@pytest.mark.parametrize(
    ("action", "sticks_held", "blocks"),
    [
        *((action, False, False) for action in (3, 4, 5)),
        *((action, False, True) for action in (0, 1, 2, 6, 7, 99)),
        *((action, True, False) for action in (0, 1, 2, 3, 4, 5)),
        *((action, True, True) for action in (6, 7, None)),
        (None, False, True),
    ],
)
def test_the_loss_action_must_end_a_flight_that_nobody_holds(
    action: int | None, sticks_held: bool, blocks: bool
) -> None:
    found = AUDIT.entries({**SAFE, "COM_OBL_RC_ACT": action} if action is not None else {}, sticks_held=sticks_held)
    assert any(entry.blocks for entry in found) == blocks


def test_every_audited_parameter_is_shown_with_its_meaning() -> None:
    found = AUDIT.entries(SAFE, sticks_held=False)
    assert tuple(entry.parameter for entry in found) == AUDIT.names
    assert all(entry.meaning for entry in found)
    assert {entry.value for entry in found if entry.parameter == "COM_RC_OVERRIDE"} == {None}


@pytest.mark.parametrize(
    ("value", "meaning"), [(-1.0, "by a mode switch only"), (0.0, "takes over"), (1.0, "takes over")]
)
@pytest.mark.parametrize("audit", [AUDIT, autopilot().audit_commanded])
def test_a_parameter_that_others_were_merged_into_is_shown_instead_of_them(
    audit: Audit, value: float, meaning: str
) -> None:
    found = audit.entries({**SAFE, "MAN_OVERRIDE_SPD": value}, sticks_held=False)
    (entry,) = (entry for entry in found if entry.parameter == "MAN_OVERRIDE_SPD")
    assert (entry.value, entry.blocks) == (value, False)
    assert meaning in entry.meaning
    assert not {entry.parameter for entry in found} & {"COM_RC_OVERRIDE", "COM_RC_STICK_OV"}


def test_a_newer_parameter_is_read_only_if_none_that_it_replaces_has_answered() -> None:
    assert AUDIT.to_read_too(SAFE) == ("MAN_OVERRIDE_SPD",)
    assert AUDIT.to_read_too({**SAFE, "COM_RC_STICK_OV": 30.0}) == ()


def test_a_late_or_absent_reaction_to_failures_is_doubtful_and_blocks_nothing() -> None:
    late = {"COM_OF_LOSS_T": 4.0, "COM_RC_IN_MODE": 4, "NAV_DLL_ACT": 0}
    found = AUDIT.entries({**SAFE, **late}, sticks_held=True)
    assert {entry.parameter for entry in found if entry.doubtful} == set(late)
    assert not any(entry.blocks for entry in found)


def test_sticks_that_are_ignored_are_doubtful_only_if_a_pilot_counts_on_them() -> None:
    found = AUDIT.entries({**SAFE, "NAV_DLL_ACT": 2}, sticks_held=False)
    assert not any(entry.doubtful for entry in found)

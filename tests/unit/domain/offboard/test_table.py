"""The capability table: whole, with a reason for every refusal, and as PX4 was flown."""

from __future__ import annotations

import pytest

from app.domain.autopilot import autopilot
from app.domain.autopilot.capability import FirmwareProfile, FlightKind, flight_kind
from app.domain.offboard.control_method import capabilities, capability
from app.domain.offboard.messages import WIRE_FORMS, Estimate
from app.domain.vehicle.state import FirmwareVersion, VehicleType, VtolState
from tests.support.golden_mission import OFFBOARD_PAGE
from tests.support.setpoint_examples import EXAMPLES
from tools.reference import with_tables

DOCUMENTED, FLOWN, UNSURE = FirmwareProfile
ROTARY, WING, ROVER, AIRSHIP = FlightKind
TAKEN_AS_FLOWN = {
    ROTARY: {
        *("position_ned", "velocity_ned", "acceleration_ned", "position_velocity_ned"),
        *("position_velocity_acceleration_ned", "velocity_body", "acceleration_body"),
        *("position_global", "velocity_global", "position_velocity_global", "attitude", "body_rates"),
    },
    WING: {"position_velocity_ned", "attitude"},
    ROVER: {"position_ned", "velocity_ned", "velocity_body", "position_global"},
    AIRSHIP: set[str](),
}


def taken(kind: FlightKind, profile: FirmwareProfile) -> set[str]:
    return {known.form for known in capabilities(kind, profile) if known.support.is_accepted}


def test_every_kind_has_a_word_on_every_form() -> None:
    for kind in FlightKind:
        assert set(autopilot().setpoints[kind]) == set(WIRE_FORMS) == set(EXAMPLES)


@pytest.mark.parametrize("kind", FlightKind)
def test_what_is_taken_on_current_firmware_is_what_was_flown_or_read_in_its_source(kind: FlightKind) -> None:
    assert taken(kind, FLOWN) == TAKEN_AS_FLOWN[kind]


def test_by_the_documents_a_wing_takes_positions_with_types_and_no_velocity() -> None:
    assert taken(WING, DOCUMENTED) == {
        *("position_ned", "position_global", "typed_position_ned", "typed_position_global", "attitude", "body_rates")
    }


@pytest.mark.parametrize("kind", FlightKind)
def test_on_firmware_that_is_neither_only_what_both_say_is_taken(kind: FlightKind) -> None:
    assert taken(kind, UNSURE) == taken(kind, DOCUMENTED) & taken(kind, FLOWN)


def test_every_refusal_has_a_stable_code_and_a_reason() -> None:
    for kind in FlightKind:
        for profile in FirmwareProfile:
            for known in capabilities(kind, profile):
                if not known.support.is_accepted:
                    assert known.support.code.startswith("setpoint.")
                    assert len(known.support.reason) > 20


@pytest.mark.parametrize("kind", FlightKind)
@pytest.mark.parametrize("form", ["thrust_torque", "actuators", "acceleration_global", "position_body"])
def test_what_bypasses_control_or_means_something_else_is_refused_everywhere(kind: FlightKind, form: str) -> None:
    assert not any(capability(form, kind, profile).support.is_accepted for profile in FirmwareProfile)


@pytest.mark.parametrize(
    ("form", "mask"),
    [
        ("position_ned", 3576),  # recorded with a multicopter and a rover
        ("position_velocity_ned", 3520),  # recorded with a plane
        ("velocity_ned", 3527),
        ("attitude", 7),
        ("body_rates", 128),
    ],
)
def test_the_masks_are_those_that_a_real_px4_took(form: str, mask: int) -> None:
    assert WIRE_FORMS[form].type_mask == mask


def test_each_form_names_the_estimate_it_needs() -> None:
    needs = {form: wire.estimate for form, wire in WIRE_FORMS.items()}
    assert needs["position_ned"] is needs["position_velocity_ned"] is Estimate.POSITION
    assert needs["velocity_ned"] is needs["acceleration_ned"] is Estimate.VELOCITY
    assert needs["attitude"] is needs["body_rates"] is Estimate.NONE


@pytest.mark.parametrize(
    ("version", "profile"),
    [(None, UNSURE), ((1, 8, 0), DOCUMENTED), ((1, 11, 9), DOCUMENTED), ((1, 14, 0), UNSURE), ((1, 16, 0), FLOWN)],
)
def test_the_firmware_says_which_column_counts(version: tuple[int, int, int] | None, profile: FirmwareProfile) -> None:
    assert autopilot().setpoint_profile(None if version is None else FirmwareVersion(*version)) is profile


@pytest.mark.parametrize(
    ("state", "kind"),
    [
        (VtolState.MULTICOPTER, ROTARY),
        (VtolState.FIXED_WING, WING),
        (VtolState.TRANSITION_TO_FIXED_WING, WING),
        (None, WING),
    ],
)
def test_a_vtol_counts_by_its_state(state: VtolState | None, kind: FlightKind) -> None:
    assert flight_kind(VehicleType.VTOL, state) is kind


def test_the_page_has_the_table_as_it_is() -> None:
    page = OFFBOARD_PAGE.read_text(encoding="utf-8")
    assert page == with_tables(page), "python -m tests.support.regenerate_golden_missions"
    assert all(f"`{form}`" in page for form in WIRE_FORMS)

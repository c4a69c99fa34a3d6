"""The autopilot's capability table, asked form by form."""

from __future__ import annotations

from app.domain.autopilot import autopilot
from app.domain.setpoint.capability import Capability, FirmwareProfile, FlightKind
from app.domain.setpoint.wire_form import WIRE_FORMS


def capability(form: str, kind: FlightKind, profile: FirmwareProfile) -> Capability:
    """The table's word on one form. KeyError for a form that does not exist."""
    return Capability(form, WIRE_FORMS[form], autopilot().setpoints[kind][form].verdict(profile))


def capabilities(kind: FlightKind, profile: FirmwareProfile) -> tuple[Capability, ...]:
    """The whole column for one vehicle."""
    return tuple(capability(form, kind, profile) for form in WIRE_FORMS)

"""PX4's EVENT interface: many reasons are said only here.

Names, log levels and arguments as recorded from px4-main, those that nobody recorded as in PX4's source.
"""

from __future__ import annotations

import struct

from app.simulator.channel import Radio
from app.simulator.clock import VehicleClock
from app.simulator.dialect import mavlink

ARGUMENT_BYTES = 40
AUTOPILOT = 1


def event_id(name: str) -> int:
    """PX4's events::ID: component 1 in the highest byte, and 24 bits of the name's FNV-1a hash."""
    number = 0x811C9DC5
    for byte in name.encode():
        number = (number ^ byte) * 0x01000193 & 0xFFFFFFFF
    return AUTOPILOT << 24 | number & 0xFFFFFF


_LAYOUTS: dict[str, tuple[int, str]] = {
    # name: (log levels, struct format of the arguments)
    "check_gf_violation_custom_gf": (51, ""),
    "check_gf_violation_max_alt": (51, ""),
    "check_gf_violation_max_hor_dist": (51, ""),
    "commander_arm_denied_resolve_failures": (98, ""),
    "commander_armed_by": (102, "B"),
    "commander_disarm_denied_not_landed": (98, ""),
    "commander_disarmed_by": (102, "B"),
    "commander_dl_regained": (102, ""),
    "commander_failsafe_enter": (66, "IBB"),
    "commander_failsafe_enter_generic": (66, "IB"),
    "commander_failsafe_enter_generic_hold": (66, "IBH"),
    "commander_failsafe_enter_generic_warn": (68, "I"),
    "commander_failsafe_enter_hold": (66, "IBHB"),
    "commander_gcs_lost": (100, ""),
    "commander_landing_current_pos": (102, ""),
    "commander_landing_detected": (102, ""),
    "commander_mission_start_denied_no_mission": (98, ""),
    "commander_modeswitch_not_avail": (98, "IB"),
    "commander_rtl": (102, ""),
    "commander_takeoff_detected": (102, ""),
    "commander_unsupported_auto_mode": (51, ""),
    "mavlink_rcv_sp_target_gl_invalid_coord": (51, "B"),
    "mavlink_rcv_sp_target_invalid": (51, ""),
    "mission_climb_before_start": (102, "f"),
    "mission_execute": (102, ""),
    "mission_finished": (102, ""),
    "mission_finished_loiter": (102, ""),
    "mission_not_valid_loiter": (147, ""),
    "navigator_geofence_invalid_against_cur_pos": (66, ""),
    "navigator_geofence_invalid_against_home": (66, ""),
    "navigator_mis_add_land_or_rm_to": (99, ""),
    "navigator_mis_add_to_or_rm_land": (99, ""),
    "navigator_mis_approach_wp_below_land": (99, ""),
    "navigator_mis_first_wp_far": (100, "I"),
    "navigator_mis_first_wp_too_far": (99, "II"),
    "navigator_mis_geofence_violation": (99, "h"),
    "navigator_mis_glide_slope_too_steep": (99, "BB"),
    "navigator_mis_invalid_land": (99, ""),
    "navigator_mis_land_before_rtl": (99, ""),
    "navigator_mis_land_missing": (99, ""),
    "navigator_mis_land_wp_inside_orbit_radius": (99, ""),
    "navigator_mis_multiple_land": (99, ""),
    "navigator_mis_no_home_rel_alt": (99, "h"),
    "navigator_mis_starts_w_landing": (99, ""),
    "navigator_mis_starts_w_landing2": (99, ""),
    "navigator_mis_takeoff_missing": (99, ""),
    "navigator_mis_takeoff_not_first": (99, ""),
    "navigator_mis_takeoff_or_land_missing": (99, ""),
    "navigator_mis_takeoff_too_low": (99, "f"),
    "navigator_mis_unsup_cmd": (67, "HH"),
    "navigator_mis_unsupported_landing_approach_wp": (99, ""),
    "navigator_reposition_outside_geofence": (99, ""),
    "navigator_route_cache_too_large": (100, "HH"),
    "navigator_takeoff_default_alt": (102, "f"),
    "rtl_completed_loiter": (102, ""),
    "rtl_destination_breaches": (100, ""),
    "rtl_avoiding_geofence": (102, ""),
    "rtl_avoidance_runtime_fallback": (50, ""),
    "rtl_land_at_destination": (102, ""),
    "rtl_mission_land_climb": (102, "i"),
    "vrtl_return_at": (102, "ii"),
}
EVENTS = {name: (event_id(name), levels, layout) for name, (levels, layout) in _LAYOUTS.items()}
"""Name to id, log levels and format."""


class EventLog:
    """Sends EVENT with a running sequence number."""

    def __init__(self, radio: Radio, clock: VehicleClock) -> None:
        self._radio = radio
        self._clock = clock
        self._sequence = 0

    def reset(self) -> None:
        """A reboot: the sequence begins again."""
        self._sequence = 0

    def emit(self, name: str, *arguments: float) -> None:
        """One event. Missing arguments are 0, too many are left off. Raises KeyError for a name that does not exist."""
        number, log_levels, layout = EVENTS[name]
        values = list(arguments[: len(layout)]) + [0] * (len(layout) - len(arguments))
        typed = [value if kind == "f" else int(value) for kind, value in zip(layout, values, strict=True)]
        packed = struct.pack("<" + layout, *typed).ljust(ARGUMENT_BYTES, b"\0")
        self._sequence = (self._sequence + 1) % 65536
        message = mavlink.MAVLink_event_message(
            0, 0, number, self._clock.boot_ms, self._sequence, log_levels, list(packed)
        )
        self._radio.broadcast(message)

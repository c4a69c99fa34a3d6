"""PX4's EVENT interface: many reasons are said only here. Ids and log levels as recorded from px4-main."""

from __future__ import annotations

import struct

from app.simulator.clock import VehicleClock
from app.simulator.dialect import mavlink
from app.simulator.radio import Radio

ARGUMENT_BYTES = 40

EVENTS: dict[str, tuple[int, int, str]] = {
    # name: (id, log levels, struct format of the arguments)
    "commander_arm_denied_resolve_failures": (16910493, 98, ""),
    "commander_armed_by": (26266355, 102, "B"),
    "commander_disarmed_by": (32794487, 102, "B"),
    "commander_dl_regained": (31011876, 102, ""),
    "commander_failsafe_enter_generic": (31382480, 66, "IB"),
    "commander_failsafe_enter_hold": (30481910, 66, "IBHB"),
    "commander_gcs_lost": (27571288, 100, ""),
    "commander_landing_current_pos": (20099806, 102, ""),
    "commander_landing_detected": (26622124, 102, ""),
    "commander_mission_start_denied_no_mission": (23844490, 98, ""),
    "commander_modeswitch_not_avail": (27280279, 98, "IB"),
    "commander_rtl": (20262116, 102, ""),
    "commander_takeoff_detected": (21054825, 102, ""),
    "commander_unsupported_auto_mode": (19869445, 51, ""),
    "mavlink_rcv_sp_target_gl_invalid_coord": (27739955, 51, "B"),
    "mavlink_rcv_sp_target_invalid": (22427557, 51, ""),
    "mission_climb_before_start": (24986204, 102, "f"),
    "mission_execute": (32375217, 102, ""),
    "mission_finished": (24580612, 102, ""),
    "mission_finished_loiter": (21455606, 102, ""),
    "mission_not_valid_loiter": (20167372, 147, ""),
    "navigator_geofence_invalid_against_home": (27750677, 66, ""),
    "navigator_mis_add_land_or_rm_to": (19546926, 99, ""),
    "navigator_mis_first_wp_far": (22091529, 100, "I"),
    "navigator_mis_geofence_violation": (19608877, 99, "h"),
    "navigator_mis_glide_slope": (21551397, 99, "B"),
    "navigator_mis_land_missing": (25237137, 99, ""),
    "navigator_mis_takeoff_not_first": (33440290, 99, ""),
    "navigator_route_cache_too_large": (25737816, 100, "HH"),
    "navigator_takeoff_default_alt": (20656071, 102, "f"),
    "rtl_destination_breaches": (22524574, 100, ""),
    "rtl_land_at_destination": (16962474, 102, ""),
    "vrtl_return_at": (22161044, 102, "ii"),
}


class EventLog:
    """Sends EVENT with a running sequence number; a name without a recorded id is not sent."""

    def __init__(self, radio: Radio, clock: VehicleClock) -> None:
        self._radio = radio
        self._clock = clock
        self._sequence = 0

    def reset(self) -> None:
        """A reboot: the sequence begins again."""
        self._sequence = 0

    def emit(self, name: str, *arguments: float) -> None:
        """One event. Missing arguments are 0."""
        known = EVENTS.get(name)
        if known is None:
            return
        event_id, log_levels, layout = known
        values = list(arguments[: len(layout)]) + [0] * (len(layout) - len(arguments))
        typed = [value if kind == "f" else int(value) for kind, value in zip(layout, values, strict=True)]
        packed = struct.pack("<" + layout, *typed).ljust(ARGUMENT_BYTES, b"\0")
        self._sequence = (self._sequence + 1) % 65536
        message = mavlink.MAVLink_event_message(
            0, 0, event_id, self._clock.boot_ms, self._sequence, log_levels, list(packed)
        )
        self._radio.broadcast(message)

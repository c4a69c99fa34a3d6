"""Which message goes out how often [Hz] by its id, until a ground station asks for other intervals."""

from __future__ import annotations

from collections.abc import Mapping

ONBOARD_HZ: Mapping[int, float] = {
    0: 1.0,  # HEARTBEAT
    1: 2.0,  # SYS_STATUS
    24: 2.0,  # GPS_RAW_INT
    30: 10.0,  # ATTITUDE
    32: 4.0,  # LOCAL_POSITION_NED
    33: 10.0,  # GLOBAL_POSITION_INT
    36: 10.0,  # SERVO_OUTPUT_RAW
    74: 4.0,  # VFR_HUD
    141: 1.0,  # ALTITUDE
    147: 0.5,  # BATTERY_STATUS
    242: 0.5,  # HOME_POSITION
    245: 5.0,  # EXTENDED_SYS_STATE
    360: 1.0,  # ORBIT_EXECUTION_STATUS, while there is an orbit
    436: 0.5,  # CURRENT_MODE
}
"""As PX4's onboard link, the fast ones at 10 Hz."""
LOW_HZ: Mapping[int, float] = {
    0: 1.0,
    1: 0.5,
    24: 0.5,
    30: 0.5,
    33: 4.0,
    36: 0.5,
    74: 0.5,
    242: 0.25,
    245: 1.0,
    436: 0.25,
}
"""With MISSION_CURRENT, which comes once a second anyhow, ten messages a second."""
RATES: Mapping[str, Mapping[int, float]] = {"onboard": ONBOARD_HZ, "low": LOW_HZ}

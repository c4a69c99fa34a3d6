"""Which faults of a vehicle are set now: those that last, by the names of the control socket."""

from __future__ import annotations

from typing import Any

from app.simulator.vehicle import Vehicle


def lasting_faults(vehicle: Vehicle, *, has_duplicate: bool) -> dict[str, Any]:
    """Name and value of each that differs from a healthy vehicle. Not what happens once (reboot, mode)."""
    faults, link = vehicle.faults, vehicle.faults.link
    values: dict[str, Any] = {
        "loss": link.loss,
        "duplicate": link.duplicate,
        "reorder": link.reorder,
        "delay_s": link.delay_s,
        "jitter_s": link.jitter_s,
        "link_cut": link.link_cut,
        "refuse_upload": faults.refuse_upload,
        "lost_ack": faults.lost_acks,
        "stuck_gripper": faults.stuck_gripper,
        "no_gripper": faults.no_gripper,
        "slow_gripper": faults.slow_gripper_s,
        "stuck_winch": vehicle.winch is not None and vehicle.winch.stuck,
        "gps_loss": faults.gps_lost,
        "range_loss": faults.range_lost,
        "wind": [faults.wind_north_m_s, faults.wind_east_m_s],
        "duplicate_sysid": has_duplicate,
    }
    return {name: value for name, value in values.items() if value not in (False, 0, [0.0, 0.0])}

"""Offboard control: leases, the stream of setpoints, the dead-man, the ways in and out."""

from app.services.offboard.control import OffboardControl
from app.services.offboard.offboard import Offboard
from app.services.offboard.settings import FASTEST_HZ, SLOWEST_HZ, OffboardSettings

__all__ = ["FASTEST_HZ", "SLOWEST_HZ", "Offboard", "OffboardControl", "OffboardSettings"]

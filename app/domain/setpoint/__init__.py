"""Setpoints: what may be asked of a vehicle in OFFBOARD mode, how it is sent, and what is refused."""

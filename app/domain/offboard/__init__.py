"""Offboard control of a vehicle: the states of offboard control, and what each input makes of them."""

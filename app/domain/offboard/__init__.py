"""Flying a vehicle by hand: the states of offboard control, and what each input makes of them."""

"""Jobs: plans that wait for a vehicle, and which vehicle may have which."""

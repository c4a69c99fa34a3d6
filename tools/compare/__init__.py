"""Measures the simulated vehicles against recordings of a real PX4: the same ground side, two vehicles, one judge."""

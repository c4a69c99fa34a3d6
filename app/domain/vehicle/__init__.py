"""The facts and the state of a vehicle, its clock, and its commands."""

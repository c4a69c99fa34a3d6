"""Offboard control: setpoints from outside, their proof of life, and what happens when they stop."""

"""PX4's land detector: one class per vehicle type over a common base. See docs/reference/simulator.md."""

"""How fast vehicle time runs is measured: a machine that cannot keep up says so instead of slipping in silence."""

from __future__ import annotations

from app.simulator.pace import Pace


class Machine:
    """Takes `step_cost_s` of wall time for each step that is due."""

    def __init__(self, speed: float) -> None:
        self.wall_s = 100.0
        self.steps = 0
        self.step_cost_s = 0.0
        self.pace = Pace(speed, lambda: self.wall_s)
        self.pace.begin()

    def run(self, seconds: float) -> Machine:
        end_s = self.wall_s + seconds
        while self.wall_s < end_s:
            while self.pace.take() and self.wall_s < end_s:
                self.steps += 1
                self.wall_s += self.step_cost_s
            self.wall_s += max(self.pace.wait_s(), 1e-6)
        return self

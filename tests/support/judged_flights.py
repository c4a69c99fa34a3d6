"""Whether simulated vehicles did what they were asked for, and nothing else, whatever happened to Waydrop meanwhile."""

from __future__ import annotations

from typing import Any, Final

from tests.support.plan_pieces import RETURN, gripper, plan_json, takeoff, waypoint
from tests.support.simulator_truth import Truth

SPEED: Final = 4.0
DELIVERIES: Final = {
    "embedded": plan_json(
        *("multicopter", takeoff(12), waypoint(40, 0, 12, hold_s=5), gripper(mode="embedded"), RETURN), name="embedded"
    ),
    "supervised": plan_json(
        *("multicopter", takeoff(12), waypoint(40, 0, 12), gripper(hold_s=120), RETURN), name="supervised"
    ),
}
"""The hold is long: a release ends it, and a restart may take a while on a busy machine."""
FLIGHT: Final = ("LOITER", "MISSION", "RTL")
"""The modes of a flight that nobody disturbs: armed in Hold, the mission, the return."""
OVER: Final = frozenset({"completed", "aborted", "failed", "lost"})


class FlightJudge:
    """Of one vehicle. `asked`: starts that were asked for and not refused, whether they were answered or not."""

    def __init__(self, vehicle_id: str, truth: Truth, failures: list[str]) -> None:
        self._vehicle_id = vehicle_id
        self._truth = truth
        self._failures = failures
        self.asked = 0

    def judge_moves(self) -> None:
        """Whether the flight so far is one that nobody disturbed."""
        modes = self._truth.modes
        if modes != [mode for mode in FLIGHT if mode in modes]:
            self._fell(f"unsafe move: {self._vehicle_id} changed its mode by {modes}")
        if self._truth.flights > self.asked:
            self._fell(f"unsafe move: {self._vehicle_id} was armed {self._truth.flights} times, asked {self.asked}")
        if self._truth.releases > 1:
            self._fell(f"unsafe move: {self._vehicle_id} released {self._truth.releases} times in a flight")

    def judge_drop(self, run: dict[str, Any]) -> str:
        """Whether the drop of a run that is over went as told. How it went, to count it."""
        outcome, released = run["drops"][0]["outcome"], self._truth.releases > 0
        if outcome != "unknown" and (outcome == "released") != released:
            self._fell(f"run {run['id']} says {outcome}, {self._truth.releases} were released: {run['drops'][0]}")
        return f"{run['state']} {outcome}"

    def _fell(self, how: str) -> None:
        if how not in self._failures:
            self._failures.append(how)

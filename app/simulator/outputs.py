"""PX4's outputs (src/lib/mixer_module): what PWM_MAIN_FUNCn assigns to each, and the pulse that it has then."""

from __future__ import annotations

from typing import Final

from app.simulator.params import Params
from app.simulator.state import VehicleState
from app.simulator.wire import GRIPPER_FUNCTION

COUNT: Final = 16
DISARMED_US: Final = 900
LOWEST_US, CENTER_US, HIGHEST_US = 1000, 1500, 2000
MOTORS: Final = range(101, 113)
SERVOS: Final = range(201, 216)


def function_params(functions: tuple[int, ...]) -> dict[str, int]:
    """The parameters of all outputs; those behind the last function are free."""
    free = (0,) * (COUNT - len(functions))
    return {f"PWM_MAIN_FUNC{n}": function for n, function in enumerate((*functions, *free), start=1)}


class Outputs:
    """The outputs of one vehicle. An assignment counts from the next time that the vehicle is disarmed."""

    def __init__(self, state: VehicleState, params: Params) -> None:
        self._state = state
        self._params = params
        self._version: int | None = None
        self._functions: tuple[int, ...] = ()

    @property
    def functions(self) -> tuple[int, ...]:
        """The function of each output."""
        if self._version != self._params.version and (self._version is None or not self._state.status.armed):
            self._version = self._params.version
            self._functions = tuple(self._params.integer(name) for name in function_params(()))
        return self._functions

    @property
    def moves_gripper(self) -> bool:
        """Whether any output is the gripper's."""
        return GRIPPER_FUNCTION in self.functions

    def pulses_us(self) -> list[int]:
        """What each output puts out now."""
        functions = self.functions
        if not self._state.status.armed:
            return [DISARMED_US] * COUNT
        return [self._pulse_us(function) for function in functions]

    def _pulse_us(self, function: int) -> int:
        if function in MOTORS:
            return LOWEST_US + int(self._state.body.throttle * (HIGHEST_US - LOWEST_US))
        if function in SERVOS:
            return CENTER_US
        if function == GRIPPER_FUNCTION:
            return LOWEST_US if self._state.gripper.output_released else HIGHEST_US
        return DISARMED_US

"""The payload deliverer: one gripper, commanded by a ground station or by the mission.

ACCEPTED after PD_GRIPPER_TO is a timer, not a sensor: it comes with a stuck gripper too, and with one that no output
moves [29_gripper_no_output].
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from app.simulator.clock import VehicleClock
from app.simulator.faults import VehicleFaults
from app.simulator.params import Params
from app.simulator.state import GripperState, VehicleState
from app.simulator.wire import GRIPPER_FUNCTION, Result

# PX4's outputs (src/lib/mixer_module): what PWM_MAIN_FUNCn assigns to each, and the pulse that it has then.


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


OUTPUT_DELAY_S = 0.06
"""From the command to the servo output [08_quad_supervised: 70 ms, 07: 20-80 ms]."""

Ack = Callable[[Result], None]


@dataclass(slots=True)
class _Action:
    release: bool
    started_s: float
    ack: Ack


class PayloadDeliverer:
    """Executes DO_GRIPPER. `ack` is called with every result for the one who asked."""

    def __init__(
        self, gripper: GripperState, params: Params, faults: VehicleFaults, clock: VehicleClock, outputs: Outputs
    ) -> None:
        self._gripper = gripper
        self._params = params
        self._faults = faults
        self._clock = clock
        self._outputs = outputs
        self._action: _Action | None = None
        self._output_due_s: float | None = None
        self._jaws_due_s: float | None = None
        self.valid = False
        """There is a gripper; read at power-up only."""
        self.boot()

    def boot(self) -> None:
        """Power-up: PD_GRIPPER_TYPE is read only here, and the gripper grabs.

        Where nothing has ever commanded it, its output is at the lowest pulse: release (FunctionGripper, 17b).
        """
        enabled = "PD_GRIPPER_EN" not in self._params or self._params.integer("PD_GRIPPER_EN") == 1
        self.valid = enabled and self._params.integer("PD_GRIPPER_TYPE") >= 0
        self._action = None
        self._output_due_s = self._jaws_due_s = None
        self._gripper.released = False
        self._gripper.output_released = not self.valid
        self._move_jaws()

    def command(self, param2: float, ack: Ack) -> None:
        """DO_GRIPPER: param2 0 releases, 1 grabs; instance and everything else are ignored."""
        if not self.valid or self._faults.no_gripper:
            ack(Result.FAILED)
            return
        release = _releases(param2)
        running = self._action
        if running is not None and running.release == release:
            ack(Result.TEMPORARILY_REJECTED)
            return
        if running is not None:
            running.ack(Result.CANCELLED)  # before the new one is looked at: an invalid one too, which stops nothing
        if release is None:
            ack(Result.DENIED)
            return
        if running is None and self._gripper.released == release:
            ack(Result.ACCEPTED)
            return
        self._action = _Action(release, self._clock.now_s, ack)
        self._gripper.released = release
        self._output_due_s = self._clock.now_s + OUTPUT_DELAY_S
        self._jaws_due_s = self._output_due_s + self._faults.slow_gripper_s
        ack(Result.IN_PROGRESS)

    def step(self) -> None:
        """Move the output, then the jaws, end the timer."""
        now_s = self._clock.now_s
        if self._output_due_s is not None and now_s >= self._output_due_s:
            self._output_due_s = None
            self._gripper.output_released = self._gripper.released
        if self._jaws_due_s is not None and now_s >= self._jaws_due_s:
            self._jaws_due_s = None
            self._move_jaws()
        action = self._action
        if action is not None:
            duration_s = float(self._params["PD_GRIPPER_TO"]) + self._faults.slow_gripper_s
            if now_s - action.started_s >= duration_s:
                self._action = None
                action.ack(Result.ACCEPTED)

    def _move_jaws(self) -> None:
        if self._outputs.moves_gripper and not self._faults.stuck_gripper:
            self._gripper.is_open = self._gripper.output_released


def _releases(param2: float) -> bool | None:
    """GRIPPER_ACTIONS, rounded half away from zero as C's roundf: 0 releases, 1 grabs; None is neither."""
    if not math.isfinite(param2) or not -0.5 < param2 < 1.5:
        return None
    return param2 < 0.5

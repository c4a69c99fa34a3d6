"""One simulated vehicle, put together: every component with exactly what it uses."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from app.simulator.airframe import Airframe
from app.simulator.channel import Radio, Sender
from app.simulator.clock import VehicleClock
from app.simulator.commander import Commander, ModeChecks, StatusOutput
from app.simulator.commands.flight import FlightCommands
from app.simulator.commands.internal import InternalCommands
from app.simulator.commands.link import CommandLink, MessageCommands, PayloadCommands, Request
from app.simulator.dialect import Message
from app.simulator.dynamics.factory import dynamics_for
from app.simulator.dynamics.model import Motion
from app.simulator.events import EventLog
from app.simulator.external.component import Mount, PayloadPort
from app.simulator.external.gripper import ExternalGripper
from app.simulator.external.others import OTHERS
from app.simulator.external.winch import Winch
from app.simulator.failsafe_action import FailsafeAction
from app.simulator.failsafes import Battery, LinkLossFailsafe, ModeWarning, PositionLossFailsafe
from app.simulator.faults import VehicleFaults
from app.simulator.firmware import FirmwareProfile
from app.simulator.geo import LocalFrame
from app.simulator.geofence_breach import GeofenceBreach
from app.simulator.identity import Identity
from app.simulator.land_detector.detectors import land_detector_for
from app.simulator.mission.reporter import MissionReporter
from app.simulator.mission.store import MissionStore
from app.simulator.mission.transfer import MissionTransfer
from app.simulator.navigator.context import Deployment, NavContext
from app.simulator.navigator.mission_mode import MissionMode, MissionResult
from app.simulator.navigator.modes import HoldMode, TakeoffMode
from app.simulator.navigator.navigator import Navigator
from app.simulator.navigator.orbit_mode import OrbitMode
from app.simulator.offboard.failsafe import OffboardLossFailsafe
from app.simulator.offboard.mode import OffboardMode
from app.simulator.offboard.receiver import OffboardReceiver, OffboardStream
from app.simulator.options import VehicleOptions
from app.simulator.param_link import ParamLink
from app.simulator.params import Params
from app.simulator.payload import Outputs, PayloadDeliverer
from app.simulator.router import Router
from app.simulator.signing import VehicleSigning
from app.simulator.state import Body, VehicleState
from app.simulator.streams import RATES, Streams
from app.simulator.telemetry import Telemetry
from app.simulator.wire import Cmd, Mode, Result, VtolState


@dataclass(frozen=True, slots=True)
class VehicleSpec:
    """What makes one vehicle different from another."""

    entry: VehicleOptions
    airframe: Airframe
    profile: FirmwareProfile
    frame: LocalFrame
    params: Params
    seed: int
    speed: float
    rates: str = "onboard"
    salt: str = ""


class Vehicle:
    """Call `step` once for every step of vehicle time, and `poll` every few milliseconds of wall time."""

    def __init__(self, spec: VehicleSpec, wall: Callable[[], float]) -> None:
        self.spec = spec
        self.system_id = spec.entry.system_id
        self.faults = VehicleFaults()
        self.state = VehicleState()
        self.store = MissionStore()
        self.params = spec.params
        self.clock = VehicleClock(speed=spec.speed)
        self.radio = Radio(self.system_id, self.clock)
        self.signing = VehicleSigning(self.system_id, spec.entry.key_file)
        self._build_flight()
        self._build_failsafes()
        self._build_wire(wall)
        self.boot()

    def _build_flight(self) -> None:
        spec, state = self.spec, self.state
        self._events = EventLog(self.radio, self.clock)
        self._status_output = StatusOutput(self.radio.text, self._events.emit)
        result = MissionResult()
        self._build_payload()
        self._offboard = OffboardStream(self.params, self.clock)
        checks = ModeChecks(state.status, self.params, self.clock, result, self._offboard)
        self.commander = Commander(
            state, self.params, self.clock, result, self._offboard, checks, self._status_output, spec.airframe.is_rover,
        )  # fmt: skip
        self._mode_warning = ModeWarning(state.status, self.commander, checks, self._events.emit)
        self.context = NavContext(
            state, self.params, self.system_id, spec.airframe, spec.profile, spec.frame, self.clock,
            self.radio.text, self._events.emit, lambda command: self._internal.issue(command),
        )  # fmt: skip
        self.mission = MissionMode(self.context, self.store, result, self._deployment)
        self._hold = HoldMode(self.context)
        self._takeoff = TakeoffMode(self.context)
        self._orbit = OrbitMode(self.context)
        offboard = OffboardMode(self.context, self._offboard)
        self._navigator = Navigator(
            self.context, self.store, self.mission, self._hold, self._takeoff, offboard, self._orbit,
            self.commander.change_mode,
        )  # fmt: skip
        self._detector = land_detector_for(spec.airframe, state, self.params, self.clock, self.faults)
        dynamics = dynamics_for(spec.airframe, self.params, state.status, spec.frame)
        self._motion = Motion(state, dynamics, self.faults, rolls=spec.airframe.is_rover)

    def _build_payload(self) -> None:
        """On board, or components on the payload port."""
        state, body = self.state, self.state.body
        self._deployment = Deployment()
        external = ExternalGripper(state.gripper, self.faults, self.clock) if self.spec.entry.external_gripper else None
        on_board = self.spec.profile.delivers_payload and external is None
        self._outputs = Outputs(state, self.params)
        self._payload: PayloadDeliverer | None = None
        if on_board:
            self._payload = PayloadDeliverer(state.gripper, self.params, self.faults, self.clock, self._outputs)
        self.winch = Winch(self.clock, lambda: body.up_m) if self.spec.entry.winch else None
        mount = Mount(state, self.spec.frame, self.clock, self.radio)
        others = [OTHERS[key](mount) for key in self.spec.entry.others]
        components = [component for component in (external, self.winch, *others) if component is not None]
        self._port = PayloadPort(self.radio, self.clock, self.faults, components)

    def _build_failsafes(self) -> None:
        spec, state = self.spec, self.state
        output = self._status_output
        actions = [FailsafeAction(state.status, self.params, self.clock, self.commander, output) for _ in range(2)]
        self.battery = Battery(state.status, self.params, actions[0], self.radio.text)
        self._link_loss = LinkLossFailsafe(state.status, self.params, self.clock, self.commander, output)
        self._position_loss = PositionLossFailsafe(state.status, self.faults, self.clock, self.commander, output)
        self._offboard_loss = OffboardLossFailsafe(state.status, self.params, self.commander, self._offboard, output)
        self._geofence_breach = GeofenceBreach(
            state, self.params, self.clock, actions[1], lambda: self._navigator.fence_in_force, self._hold.hold_at,
            output, spec.profile.names_fence_limit,
        )  # fmt: skip

    def _build_wire(self, wall: Callable[[], float]) -> None:
        spec, state = self.spec, self.state
        flight = FlightCommands(
            self.context, self.commander, self.mission, self._hold, self._takeoff, self._orbit, self._transition,
            lambda: self._navigator.fence_in_force,
        )  # fmt: skip
        self._internal = InternalCommands(
            self.radio,
            self.clock,
            self._payload,
            self._port,
            self._deployment,
            {
                Cmd.DO_CHANGE_SPEED: lambda params: flight.apply_speed(params[1]),
                Cmd.NAV_RETURN_TO_LAUNCH: lambda params: self._return(),
                Cmd.DO_VTOL_TRANSITION: lambda params: self._transition_in_mission(params[0]),
            },
        )
        self.identity = Identity(spec.profile, spec.seed, self.system_id, spec.salt)
        telemetry = Telemetry(state, spec.airframe, spec.frame, self.clock, self.faults, self.identity, self._outputs)
        self._streams = Streams(telemetry, self.radio, self.clock, RATES[spec.rates])
        payload_commands = PayloadCommands(self._payload)
        self._commands = CommandLink(
            self.radio,
            self.faults,
            {
                **flight.handlers(),
                **MessageCommands(telemetry, self._streams, self.radio).handlers(),
                **(payload_commands.handlers() if spec.profile.delivers_payload else {}),
                Cmd.PREFLIGHT_REBOOT_SHUTDOWN: self._on_reboot,
            },
        )
        payload_commands.connect(self._commands)
        self._transfer = MissionTransfer(self.store, self.radio, spec.profile, spec.airframe, self.faults, wall)
        self._param_link = ParamLink(self.params, self.radio, self.clock, spec.profile.reports_param_errors)
        self._reporter = MissionReporter(
            self.mission.result, self.store, state.status, self.radio, self.clock, spec.profile
        )
        self._router = Router(
            self.radio,
            self._transfer,
            self.mission,
            self._param_link,
            self._commands,
            self._link_loss,
            self.clock,
            OffboardReceiver(self.context, self._offboard),
        )
        self._reboot_wanted = False

    # life ---------------------------------------------------------------------------------------------------

    def boot(self) -> None:
        """Power-up at the start point: missions and parameters are kept, everything else begins again."""
        self._put_back()
        self.clock.restart()
        self.radio.boot()
        self.signing.boot()
        self._events.reset()
        self.commander.boot()
        self._mode_warning.boot()
        self._detector.boot()
        if self._payload is not None:
            self._payload.boot()
        self._navigator.boot()
        self._link_loss.boot()
        self._offboard.boot()
        self._offboard_loss.boot()
        self._geofence_breach.boot()
        self._position_loss.boot()
        self._internal.boot()
        self._streams.boot()
        self._reporter.boot()
        self._transfer.reset()
        self._commands.reset()
        self._param_link.boot()
        self._port.boot()

    def reboot(self) -> None:
        """Restart the autopilot: in the next cycle, the mission begins at item 0 again."""
        self._reboot_wanted = True

    def _put_back(self) -> None:
        body, fresh = self.state.body, Body()
        for name in Body.__slots__:
            setattr(body, name, getattr(fresh, name))
        vtol = self.spec.airframe.is_vtol
        self.state.status.vtol_state = VtolState.MC if vtol else VtolState.UNDEFINED
        self._motion.reset()

    # running ------------------------------------------------------------------------------------------------

    def receive(self, channel: Sender, message: Message) -> None:
        self._router.receive(channel, message)
        if message.get_type() == "COMMAND_LONG":
            self._port.on_command(channel, message)
        elif message.get_type() == "SETUP_SIGNING" and self.spec.profile.signs and not self.radio.silent:
            self.radio.text(*self.signing.on_setup(message, armed=self.state.status.armed))

    def step(self) -> None:
        """One step of vehicle time."""
        if self._reboot_wanted:
            self._reboot_wanted = False
            self.store.current_seq = 0
            self.mission.result.seq_current = 0
            self.boot()
        self.clock.advance()
        self._offboard.step()
        self._commands.step()
        self._navigator.step()
        self._internal.step()
        if self._payload is not None:
            self._payload.step()
        self._motion.step(self.context.setpoint)
        self._detector.step(self.context.setpoint)
        self.commander.step()
        self._mode_warning.step()
        self._link_loss.step()
        self._offboard_loss.step()
        self._geofence_breach.step()
        self.battery.step()
        self._position_loss.step()
        self._port.step()
        self._streams.step()

    def poll(self) -> None:
        """Timers of the wire: repeats, lists, reports."""
        if (jump := self.mission.jumps.take_changed()) is not None:
            self._transfer.send_changed(jump)
        self._transfer.poll()
        self._param_link.poll()
        self._reporter.poll()

    # commands that need more than one component -------------------------------------------------------------

    def _on_reboot(self, request: Request) -> Result:
        if request.whole(1) != 1:
            return Result.DENIED
        self.reboot()
        return Result.ACCEPTED

    def _transition(self, wanted: float) -> Result:
        if not self.spec.airframe.is_vtol or not math.isfinite(wanted):
            return Result.DENIED
        if round(wanted) == VtolState.FW and self.state.body.on_ground:
            return Result.TEMPORARILY_REJECTED
        self._motion.transition(round(wanted))
        self.context.change_speed(math.nan)  # navigator: reset_cruising_speed
        return Result.ACCEPTED

    def _return(self) -> None:
        """A mission's return item ends the mission: hold, not mission, follows the disarming [06, 07, 08]."""
        self.commander.change_mode(Mode.LOITER)
        self.commander.return_to_launch()

    def _transition_in_mission(self, wanted: float) -> None:
        self._transition(wanted)

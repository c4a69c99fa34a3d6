"""SimulatorControl over the socket of the real simulator: what is set is told, and a refusal has its reason."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest

from app.domain.errors import SimulatorRefusedError, SimulatorSilentError
from app.simulator.fault_control import ControlServer, FaultControl
from app.simulator.fleet import Fleet
from app.simulator.options import Options, VehicleOptions
from app.vehicles import SimulatorControlSocket

VEHICLES = (VehicleOptions("quad", 1), VehicleOptions("plane", 7))


@pytest.fixture
async def server() -> AsyncIterator[ControlServer]:
    server = ControlServer(FaultControl(Fleet(Options(fleet=VEHICLES))))
    yield server
    await server.close()


@pytest.fixture
async def control(server: ControlServer) -> SimulatorControlSocket:
    return SimulatorControlSocket("127.0.0.1", await server.open(0))


async def test_each_vehicle_is_told_with_its_faults(control: SimulatorControlSocket) -> None:
    await control.set_fault("wind", (3.0, -2.0), system_id=7)
    await control.set_fault("gps_loss", True, system_id=None)
    told = {vehicle.system_id: (vehicle.type, vehicle.faults) for vehicle in (await control.state()).vehicles}
    assert told == {1: ("quad", {"gps_loss": True}), 7: ("plane", {"gps_loss": True, "wind": [3.0, -2.0]})}


async def test_a_refusal_has_the_simulators_reason(control: SimulatorControlSocket) -> None:
    with pytest.raises(SimulatorRefusedError, match="vehicle 7 has no winch"):
        await control.set_fault("stuck_winch", True, system_id=7)
    with pytest.raises(SimulatorRefusedError, match="no vehicle with system id 9"):
        await control.set_fault("link_cut", True, system_id=9)


async def test_a_speed_that_was_set_is_the_one_that_is_told(control: SimulatorControlSocket) -> None:
    assert (await control.state()).speed.wanted == 1.0
    assert (await control.set_speed(12.5)).wanted == 12.5
    assert (await control.state()).speed.wanted == 12.5
    with pytest.raises(SimulatorRefusedError, match="not between 1"):
        await control.set_speed(51.0)


async def test_a_simulator_that_has_gone_is_silent(control: SimulatorControlSocket, server: ControlServer) -> None:
    await server.close()
    with pytest.raises(SimulatorSilentError, match=r"127\.0\.0\.1"):
        await control.state()

"""The control socket of a simulator process: TCP, one JSON object a line each way. Implements SimulatorControl."""

from __future__ import annotations

import asyncio
import json
from typing import Final

from pydantic import BaseModel, Field, ValidationError

from app.domain.errors import SimulatorRefusedError, SimulatorSilentError
from app.domain.ports.simulated_vehicles import SimulatedVehicle, SimulatorSpeed, SimulatorState

ANSWER_S: Final = 2.0
MAX_ANSWER_BYTES: Final = 1024 * 1024
_HINT: Final = "check whether the simulated vehicles are running; restart them with `waydrop down`, then `waydrop up`"


class _State(SimulatedVehicle):
    system_id: int = Field(validation_alias="vehicle")


class _Answer(BaseModel):
    ok: bool
    error: str = ""
    vehicles: tuple[_State, ...] = ()
    speed: SimulatorSpeed | None = None


class SimulatorControlSocket:
    """SimulatorControl at 127.0.0.1:`port`. One connection a request: nothing is held between them."""

    def __init__(self, host: str, port: int, *, answer_s: float = ANSWER_S) -> None:
        self._host = host
        self._port = port
        self._answer_s = answer_s

    async def state(self) -> SimulatorState:
        answer = await self._ask({"query": "state"})
        return SimulatorState(speed=self._speed_of(answer), vehicles=answer.vehicles)

    async def set_fault(self, fault: str, value: object, *, system_id: int | None) -> None:
        await self._ask({"vehicle": system_id, "fault": fault, "value": value})

    async def set_speed(self, speed: float) -> SimulatorSpeed:
        return self._speed_of(await self._ask({"speed": speed}))

    def _speed_of(self, answer: _Answer) -> SimulatorSpeed:
        if answer.speed is None:
            raise self._silent("does not report its speed")
        return answer.speed

    async def _ask(self, request: dict[str, object]) -> _Answer:
        try:
            async with asyncio.timeout(self._answer_s):
                line = await self._exchange(json.dumps(request).encode() + b"\n")
        except TimeoutError:
            raise self._silent(f"did not answer within {self._answer_s:g} s") from None
        except (OSError, ValueError) as error:  # ValueError: a line without an end
            raise self._silent(f"is unreachable: {error}") from error
        try:
            answer = _Answer.model_validate_json(line)
        except ValidationError:
            raise self._silent("closed the connection" if not line else "sent an invalid answer") from None
        if not answer.ok:
            raise SimulatorRefusedError(answer.error)
        return answer

    async def _exchange(self, line: bytes) -> bytes:
        reader, writer = await asyncio.open_connection(self._host, self._port, limit=MAX_ANSWER_BYTES)
        try:
            writer.write(line)
            await writer.drain()
            return await reader.readline()
        finally:
            writer.close()

    def _silent(self, what: str) -> SimulatorSilentError:
        return SimulatorSilentError(f"the simulator at {self._host}:{self._port} {what}", hint=_HINT)

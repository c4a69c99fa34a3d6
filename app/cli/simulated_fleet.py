"""Which simulated vehicles `waydrop up` starts, and how they reach the service's connections."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from app.config import SettingsError
from app.domain.autopilot import autopilot
from app.domain.live_control import MAX_LIVE_RATE
from app.domain.performance import Performance

FLEET: Final = ("quad", "quad", "plane", "vtol")
LOCAL_PORT_OFFSET: Final = 40
"""As PX4 does: it sends from 14580 to 14540."""
PERFORMANCE: Final = Performance(payload_max_kg=2.0, battery_percent_per_min=4.0)
"""What is declared of each of them, if nothing else is: full to empty in 25 minutes, whatever they do."""

_LOCAL = re.compile(r"^udpin://(127\.0\.0\.1|0\.0\.0\.0):(?P<port>\d+)$")


@dataclass(frozen=True, slots=True)
class SimulatedFleet:
    """The vehicles of `waydrop up`, on ports that fit the connections."""

    port: int
    shared_port: bool
    speed: float
    seed: int

    @classmethod
    def for_connections(cls, connections: Sequence[str], *, speed: float, seed: int) -> SimulatedFleet:
        """The fleet on one port for all, or on one port each.

        Raises:
            SettingsError: the connections are not UDP ports of this machine in a row.
        """
        found = [_LOCAL.match(url) for url in connections]
        ports = [int(match["port"]) for match in found if match is not None]
        rising = [*range(ports[0], ports[0] + len(FLEET))] if ports else []
        if len(ports) != len(connections) or ports not in (rising, ports[:1]):
            raise SettingsError(
                f"WAYDROP_CONNECTIONS: {len(FLEET)} simulated vehicles cannot reach {', '.join(connections)}",
                hint=f"give one udpin:// port of this machine, or {len(FLEET)} in a row: "
                "udpin://127.0.0.1:14540..14543; for other vehicles use `waydrop serve`",
            )
        return cls(port=ports[0], shared_port=len(ports) == 1, speed=speed, seed=seed)

    def arguments(self) -> tuple[str, ...]:
        """The simulator's command line."""
        shared = ("--shared-port",) if self.shared_port else ()
        return (
            *("--fleet", ",".join(FLEET), "--port", str(self.port), "--local-port", str(self.port + LOCAL_PORT_OFFSET)),
            *("--speed", f"{self.speed:g}", "--seed", str(self.seed)),
            # nobody holds sticks here: a lost offboard stream is Hold, and a critical battery brings it home
            *("--params", ",".join(f"{name}={value}" for name, value in autopilot().unattended.items())),
            *("--control-port", "0"),  # any free one: the simulator tells it, see SimulatorProcess.control
            *shared,
        )

    def words(self) -> str:
        """For people."""
        ports = f"port {self.port}" if self.shared_port else f"ports {self.port} to {self.port + len(FLEET) - 1}"
        live = f" (above {MAX_LIVE_RATE:g} times, supervised drops and OFFBOARD are refused)"
        pace = f"{self.speed:g} times real time{live if self.speed > MAX_LIVE_RATE else ''}"
        return f"two multicopters, one fixed wing, one VTOL on UDP {ports}, {pace}"

"""A fixed amount of plain Python, of the kind that simulated vehicles do: what its CPU time is, others are told in.

Run as a process: `python -m bench.reference_loop` prints the CPU seconds of one unit, the mean of a second's worth.
"""

from __future__ import annotations

import math
import sys
import time

STEPS = 5_000
UNITS = 200


class _Body:
    __slots__ = ("north_m", "v_north_m_s", "yaw_rad")

    def __init__(self) -> None:
        self.north_m = self.v_north_m_s = self.yaw_rad = 0.0


def unit() -> float:
    """CPU seconds of one unit."""
    begin_s = time.process_time()
    body = _Body()
    for step in range(STEPS):
        wanted = 5.0 * math.cos(body.yaw_rad) if step % 3 else 0.0
        body.v_north_m_s += max(-0.1, min(0.1, wanted - body.v_north_m_s))
        body.north_m += body.v_north_m_s * 0.02
        body.yaw_rad = math.atan2(math.sin(body.yaw_rad + 0.01), math.cos(body.yaw_rad + 0.01))
    return time.process_time() - begin_s


if __name__ == "__main__":
    sys.stdout.write(f"{sum(unit() for _ in range(UNITS)) / UNITS:.6f}\n")

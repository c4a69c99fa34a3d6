"""What the page's main thread does, told by Chromium: shares of its time, long tasks, and how often what is drawn.

A long frame is Chromium's word for an update of the screen that held the main thread for over 50 ms (`long-animation-
frame`); it says which scripts ran in it. What is left is style, layout, paint, and waiting for the map's WebGL, which
on a machine without a graphics card is drawn by processors.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from playwright.async_api import CDPSession, Page

WATCH: Final = """
window.long = [];
window.slow = [];
window.drawn = { frames: 0, map: 0, vehicles: 0 };
new PerformanceObserver(list => long.push(...list.getEntries().map(e => e.duration))).observe({ type: 'longtask' });
new PerformanceObserver(list => slow.push(...list.getEntries().map(frame => {
  const isOf = map => script => script.sourceURL.includes('maplibre') === map;
  const of = map => frame.scripts.filter(isOf(map)).reduce((sum, script) => sum + script.duration, 0);
  return [frame.duration, of(false), of(true)];
}))).observe({ type: 'long-animation-frame' });
const count = () => { drawn.frames += 1; requestAnimationFrame(count); };
requestAnimationFrame(count);
const { clear } = WebGL2RenderingContext.prototype, { clearRect } = CanvasRenderingContext2D.prototype;
WebGL2RenderingContext.prototype.clear = function (mask) {
  if (mask & this.COLOR_BUFFER_BIT) drawn.map += 1;
  clear.call(this, mask);
};
CanvasRenderingContext2D.prototype.clearRect = function (...box) {
  if (this.canvas.className === 'map-vehicles') drawn.vehicles += 1;
  clearRect.apply(this, box);
};
"""
CLEAR: Final = """() => {
  long.length = slow.length = 0;
  Object.assign(drawn, { frames: 0, map: 0, vehicles: 0 });
}"""


@dataclass(frozen=True, slots=True)
class Metrics:
    """Seconds so far. `thread_s` is processor time; the others are by the wall's clock, longer under load."""

    thread_s: float
    script_s: float
    layout_s: float
    task_s: float

    @classmethod
    async def now(cls, cdp: CDPSession) -> Metrics:
        """`Performance.enable` must have been sent."""
        told = {one["name"]: float(one["value"]) for one in (await cdp.send("Performance.getMetrics"))["metrics"]}
        layout_s = told["LayoutDuration"] + told["RecalcStyleDuration"]
        return cls(told["ThreadTime"], told["ScriptDuration"], layout_s, told["TaskDuration"])

    def since(self, before: Metrics, took_s: float) -> Metrics:
        """Shares of this time."""
        return Metrics(
            (self.thread_s - before.thread_s) / took_s,
            (self.script_s - before.script_s) / took_s,
            (self.layout_s - before.layout_s) / took_s,
            (self.task_s - before.task_s) / took_s,
        )


@dataclass(frozen=True, slots=True)
class LongFrame:
    """Milliseconds: all of it, the page's own scripts, and the map library's."""

    all_ms: float
    page_ms: float
    map_ms: float


@dataclass(frozen=True, slots=True)
class Cost:
    """One stretch of time."""

    name: str
    telemetry_hz: float
    frames_hz: float
    map_hz: float
    vehicles_hz: float
    shares: Metrics
    long_tasks_ms: Sequence[float]
    long_frames: Sequence[LongFrame]


async def measure(name: str, page: Page, cdp: CDPSession, telemetry: Sequence[object], seconds: float) -> Cost:
    """Look at the page for a while; `telemetry` grows with each frame that arrives."""
    await page.evaluate(CLEAR)
    frames, before, began_s = len(telemetry), await Metrics.now(cdp), asyncio.get_running_loop().time()
    await asyncio.sleep(seconds)
    took_s = asyncio.get_running_loop().time() - began_s
    long_tasks, slow, drawn = await page.evaluate("() => [long, slow, drawn]")
    return Cost(
        name,
        (len(telemetry) - frames) / took_s,
        drawn["frames"] / took_s,
        drawn["map"] / took_s,
        drawn["vehicles"] / took_s,
        (await Metrics.now(cdp)).since(before, took_s),
        long_tasks,
        [LongFrame(*one) for one in slow],
    )


def print_costs(costs: Sequence[Cost]) -> None:
    """Three tables: how often, the main thread's time, and what held it for over 50 ms."""
    out = sys.stdout.write
    out("               telemetry   frames  vehicles drawn  map drawn\n")
    for cost in costs:
        out(
            f"{cost.name:<14} {cost.telemetry_hz:6.1f} Hz {cost.frames_hz:5.1f} Hz "
            f"{cost.vehicles_hz:12.1f} Hz {cost.map_hz:7.1f} Hz\n"
        )
    out("main thread    processor   scripts   style and layout   paint and waiting for the map's WebGL\n")
    for cost in costs:
        of = cost.shares
        rest = of.task_s - of.script_s - of.layout_s
        out(f"{cost.name:<14} {of.thread_s:9.0%} {of.script_s:9.0%} {of.layout_s:18.0%} {rest:39.0%}\n")
    out("over 50 ms     tasks   together   longest   frames   the page's scripts   the map's scripts   all else\n")
    for cost in costs:
        tasks, frames = cost.long_tasks_ms, cost.long_frames
        page_ms, map_ms = sum(f.page_ms for f in frames), sum(f.map_ms for f in frames)
        rest_ms = sum(f.all_ms for f in frames) - page_ms - map_ms
        out(
            f"{cost.name:<14} {len(tasks):5} {sum(tasks):7.0f} ms {max(tasks, default=0.0):6.0f} ms {len(frames):8} "
            f"{page_ms:17.0f} ms {map_ms:16.0f} ms {rest_ms:7.0f} ms\n"
        )

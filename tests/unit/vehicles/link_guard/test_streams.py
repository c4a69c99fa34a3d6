"""A stream is looked at piece by piece, so that one peer's noise leaves the event loop to all others."""

from __future__ import annotations

from app.domain.vehicle.link_security import RefusalKind
from app.vehicles.link_guard.policy import Peer
from app.vehicles.link_guard.rate_budget import RateBudget, RateBudgets
from app.vehicles.link_guard.streams import ByteStream, StallWatch
from tests.support.driving import until
from tests.support.mavlink_frames import FrameSender

PEER = Peer("10.0.0.2", "10.0.0.2:5000", is_allowed=True)
NOISE = b"\xfe"
"""Each of these bytes may begin a frame, whose checksum is wrong."""


class Guard:
    """What came out."""

    def __init__(self, systems: int) -> None:
        self.frames: list[bytes] = []
        self.refusals: list[RefusalKind] = []
        self._systems = systems

    def deliver(self, data: bytes, peer: Peer, late: bool) -> int:
        self.frames.append(data)
        return 1

    def flush(self) -> None: ...

    def refuse(self, kind: RefusalKind, peer: Peer) -> None:
        self.refusals.append(kind)

    def owns(self, peer: Peer) -> bool:
        return self._systems > 0

    def systems_of(self, peer: Peer) -> int:
        return self._systems

    def lost(self, peer: Peer) -> None: ...


class Reader:
    """Where the bytes come from."""

    def __init__(self) -> None:
        self.is_reading = True

    def pause_reading(self) -> None:
        self.is_reading = False

    def resume_reading(self) -> None:
        self.is_reading = True


async def test_noise_of_an_unknown_peer_is_not_looked_at_in_one_go() -> None:
    guard, reader, watch = Guard(0), Reader(), StallWatch()
    stream = ByteStream(PEER, guard, watch, reader, RateBudgets())
    stream.feed(NOISE * 1_000_000)
    assert not reader.is_reading
    assert len(guard.refusals) < 10, "a few pieces of 4,000 were looked at"
    stream.close()
    watch.close()


async def test_frames_behind_noise_arrive_and_reading_goes_on() -> None:
    guard, reader, watch = Guard(1), Reader(), StallWatch()
    stream = ByteStream(PEER, guard, watch, reader, RateBudgets())
    frames = [FrameSender(1).heartbeat(), FrameSender(1).position()]
    stream.feed(NOISE * 20_000 + bytes(300) + b"".join(frames))
    assert not reader.is_reading
    await until(lambda: reader.is_reading, "all of it must be looked at", 20.0)
    assert guard.frames[-2:] == frames, "one damaged frame of 256 passes for whole"
    stream.close()
    watch.close()


async def test_a_stream_of_frames_as_a_vehicle_sends_it_never_waits() -> None:
    guard, reader, watch = Guard(1), Reader(), StallWatch()
    stream = ByteStream(PEER, guard, watch, reader, RateBudgets())
    frames = [FrameSender(1).position(boot_ms=number) for number in range(40)]
    for frame in frames:
        stream.feed(frame)
    assert reader.is_reading
    assert guard.frames == frames
    stream.close()
    watch.close()


def test_a_budget_that_was_used_up_comes_back_at_its_rate() -> None:
    budget = RateBudget(1000.0, burst_s=0.1)
    assert budget.spend(99, 10.0) == 0.0
    pause_s = budget.spend(501, 10.0)
    assert 0.5 <= pause_s <= 0.6, "what was used beyond it is waited for"
    assert budget.spend(1, 10.0 + pause_s) == 0.0


def test_beyond_its_budget_a_vehicle_uses_what_others_leave() -> None:
    pool = RateBudget(1000.0, burst_s=0.1)
    one, other = RateBudget(100.0, burst_s=1.0, pool=pool), RateBudget(100.0, burst_s=1.0, pool=pool)
    assert [one.spend(50, 10.0) for _ in range(4)] == [0.0, 0.0, 0.0, 0.0]
    assert one.spend(50, 10.0) > 0.0
    assert other.spend(99, 10.0) == 0.0, "its own budget is its own"

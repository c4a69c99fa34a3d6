"""The guard on real sockets and devices: whole frames pass both ways, and what must not pass does not."""

from __future__ import annotations

import asyncio
import os
import socket
import threading
import time
from collections.abc import AsyncIterator
from contextlib import ExitStack, asynccontextmanager

import pytest

from app.domain.errors import LinkError
from app.domain.vehicle.link_security import LinkSecurity, RefusalKind
from app.vehicles.link_guard.guard import LinkGuard
from app.vehicles.link_guard.keyring import StoredKey
from app.vehicles.link_guard.memory import SigningStore
from app.vehicles.link_guard.options import parse_connection
from app.vehicles.link_guard.signing import SigningKey, is_signed_by
from app.vehicles.link_guard.udp import UdpClient
from tests.support.driving import until
from tests.support.guarded_link import (
    LOOPBACK,
    End,
    Guarded,
    SerialEnd,
    TcpEnd,
    UdpEnd,
    arrives,
    guarded,
    heard_until,
    stays_silent,
    udpin,
)
from tests.support.mavlink_frames import FrameSender
from tests.support.simulated import free_udp_ports

SECRET = b"s" * 32
VEHICLE, GROUND, FORGER = FrameSender(1, 1), FrameSender(245, 190), FrameSender(1, 1)
OTHER_ADDRESS = "127.0.0.2"


@asynccontextmanager
async def linked(scheme: str, store: SigningStore | None = None) -> AsyncIterator[tuple[Guarded, End]]:
    """A guarded connection of each kind, and the vehicle at its other end."""
    end: End
    if scheme == "udpin":
        async with udpin(store=store) as both:
            yield both
    elif scheme == "udpout":
        end = UdpEnd()
        async with guarded(f"udpout://{LOOPBACK}:{end.port}", store) as link:
            await until(lambda: bool(end.received()), "a vehicle that waits must be greeted", 5.0)
            yield link, end
        end.close()
    elif scheme == "tcpin":
        port = free_udp_ports(1)
        async with guarded(f"tcpin://{LOOPBACK}:{port}", store) as link:
            end = TcpEnd(socket.create_connection((LOOPBACK, port)))
            yield link, end
            end.close()
    elif scheme == "tcpout":
        with socket.create_server((LOOPBACK, 0)) as server:
            async with guarded(f"tcpout://{LOOPBACK}:{server.getsockname()[1]}", store) as link:
                sock, _ = await asyncio.to_thread(server.accept)
                end = TcpEnd(sock)
                yield link, end
                end.close()
    else:
        end = SerialEnd()
        async with guarded(f"serial://{end.device}:57600", store) as link:
            yield link, end
        end.close()


SCHEMES = pytest.mark.parametrize("scheme", ["udpin", "udpout", "tcpin", "tcpout", "serial"])


@SCHEMES
async def test_frames_pass_both_ways(scheme: str) -> None:
    async with linked(scheme) as (link, vehicle):
        heartbeat, position, command = VEHICLE.heartbeat(), VEHICLE.position(), GROUND.command(1, 400, 1)
        await arrives(link.mavsdk, heartbeat, lambda: vehicle.send(heartbeat))
        await arrives(link.mavsdk, position, lambda: vehicle.send(position))
        await arrives(vehicle, command, lambda: link.mavsdk.send(command))
        assert link.guard.security(1) is LinkSecurity.PINNED
        assert link.guard.relayed().from_vehicles >= 2


@SCHEMES
async def test_of_frames_that_come_at_once_all_pass_in_order_in_datagrams_that_mavsdk_takes(scheme: str) -> None:
    async with linked(scheme) as (link, vehicle):
        heartbeat = VEHICLE.heartbeat()
        await arrives(link.mavsdk, heartbeat, lambda: vehicle.send(heartbeat))
        frames = [VEHICLE.attitude() for _ in range(200)]
        for number, frame in enumerate(frames):
            vehicle.send(frame)
            if number % 20 == 0:
                vehicle.send(FrameSender(9).position())  # never announced, so it must not pass
        heard: list[bytes] = []
        async with asyncio.timeout(5.0):
            while sum(map(len, heard)) < sum(map(len, frames)):
                heard.append(await asyncio.get_running_loop().sock_recv(link.mavsdk.sock, 65_535))
        assert b"".join(heard) == b"".join(frames)
        assert max(map(len, heard)) <= 1400, "as a network carries: mavsdk reads no more than 2,048 bytes"


@SCHEMES
async def test_a_signed_vehicle_is_spoken_to_with_signatures(scheme: str) -> None:
    key = SigningKey(SECRET)
    store = SigningStore()
    store.signing.ring.replace({1: [StoredKey(key, in_use=True)]})
    async with linked(scheme, store) as (link, vehicle):
        signer, command = FrameSender(1, 1, key=SECRET), GROUND.command(1, 400, 1)
        heartbeat = signer.heartbeat()
        await arrives(link.mavsdk, heartbeat, lambda: vehicle.send(heartbeat))
        vehicle.received()
        heard = b""

        def is_heard() -> bool:
            nonlocal heard
            link.mavsdk.send(command)  # what waits for a busy machine is dropped
            heard += vehicle.received()
            return len(heard) >= len(command) + 13

        await until(is_heard, "the command must arrive", 5.0)
        assert is_signed_by(heard[-len(command) - 13 :], key)
        vehicle.send(FORGER.position())
        await until(lambda: link.refused(RefusalKind.UNSIGNED) > 0, "what is not signed must be refused", 5.0)
        assert link.guard.security(1) is LinkSecurity.SIGNED


async def test_of_the_pings_to_everybody_one_passes_and_those_to_one_vehicle_all_do() -> None:
    pings = [GROUND.ping() for _ in range(20)]
    answers = [GROUND.ping(target=1) for _ in range(3)]
    last = GROUND.command(1, 400, 1)
    for _ in range(5):
        heard, is_whole = await _heard_by_the_vehicle((*pings, *answers, last))
        if is_whole:
            break
    assert heard == b"".join((pings[0], *answers, last))


async def _heard_by_the_vehicle(frames: tuple[bytes, ...]) -> tuple[bytes, bool]:
    """What arrives of what mavsdk sends, up to the last frame; and whether none was dropped for a machine that hung."""
    async with udpin() as (link, vehicle):
        heartbeat, heard = VEHICLE.heartbeat(), b""
        await arrives(link.mavsdk, heartbeat, lambda: vehicle.send(heartbeat))
        for frame in frames:
            link.mavsdk.send(frame)

        def is_over() -> bool:
            nonlocal heard
            heard += vehicle.received()
            return frames[-1] in heard or link.refused(RefusalKind.LATE) > 0

        await until(is_over, "the last frame must arrive", 5.0)
        return heard, link.refused(RefusalKind.LATE) == 0


async def test_a_stranger_neither_speaks_nor_hears() -> None:
    async with udpin() as (link, vehicle):
        stranger = UdpEnd(vehicle.to, address=OTHER_ADDRESS)
        heartbeat, ping, command = VEHICLE.heartbeat(), FORGER.ping(), GROUND.command(1, 400, 1)
        stranger.send(ping)
        await arrives(link.mavsdk, heartbeat, lambda: vehicle.send(heartbeat))
        fake = FORGER.position(boot_ms=1)
        stranger.send(fake)
        await stays_silent(link.mavsdk, fake)
        await arrives(vehicle, command, lambda: link.mavsdk.send(command))
        assert stranger.received() == b""
        assert link.refused(RefusalKind.OTHER_PEER) == 1
        stranger.close()


async def test_a_flood_of_strangers_crowds_no_vehicle_out() -> None:
    async with udpin() as (link, vehicle):
        heartbeat = VEHICLE.heartbeat()
        await arrives(link.mavsdk, heartbeat, lambda: vehicle.send(heartbeat))
        stop = threading.Event()

        def flood() -> None:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
                sock.bind((OTHER_ADDRESS, 0))
                frame = FORGER.position()
                while not stop.is_set():
                    sock.sendto(frame, vehicle.to or ("", 0))

        flooding = threading.Thread(target=flood)
        flooding.start()
        try:
            sent, got = 0, b""
            for number in range(200):
                vehicle.send(VEHICLE.attitude(boot_ms=number))
                sent += 1
                await asyncio.sleep(0.005)
                got += link.mavsdk.received()
        finally:
            stop.set()
            flooding.join()
        await until(lambda: link.guard.relayed().from_vehicles > sent, "every frame of the vehicle must pass", 5.0)
        assert link.refused(RefusalKind.OTHER_PEER) > 0


async def test_a_port_of_another_program_is_refused_and_nobody_can_take_ours() -> None:
    port = free_udp_ports(1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        other.bind((LOOPBACK, port))
        guard = LinkGuard(parse_connection(f"udpin://{LOOPBACK}:{port}"), SigningStore(), 0)
        with pytest.raises(LinkError, match=str(port)):
            await guard.open()
    async with udpin() as (link, vehicle):
        heartbeat = VEHICLE.heartbeat()
        await arrives(link.mavsdk, heartbeat, lambda: vehicle.send(heartbeat))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as thief:
            thief.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            with pytest.raises(OSError, match="in use"):
                thief.bind(vehicle.to or ("", 0))


async def test_mavsdk_listens_on_loopback_alone() -> None:
    async with udpin() as (link, _):
        assert link.guard.inner_url.startswith("udpin://127.0.0.1:")
        assert link.mavsdk.sock.getsockname()[0] == LOOPBACK


async def test_a_vehicle_without_a_clock_that_restarts_is_heard_again() -> None:
    """As PX4: after its start it signs with the timestamp at which it was given its key."""
    store = SigningStore()
    store.signing.ring.replace({1: [StoredKey(SigningKey(SECRET), in_use=True)]})
    async with udpin(store=store) as (link, vehicle):
        old = FrameSender(1, 1, key=SECRET, timestamp=1000).heartbeat()
        told = b""
        async with asyncio.timeout(5.0):
            while not told:
                vehicle.send(old)
                await asyncio.sleep(0.05)
                told = vehicle.received()
        assert is_signed_by(told, SigningKey(SECRET))
        assert told[7:10] == bytes(3), "it is a HEARTBEAT"
        later = FrameSender(1, 1, key=SECRET, timestamp=int.from_bytes(told[-12:-6], "little") + 1).heartbeat()
        await arrives(link.mavsdk, later, lambda: vehicle.send(later))


async def test_a_serial_device_that_is_plugged_in_again_goes_on(tmp_path_factory: pytest.TempPathFactory) -> None:
    first, link_path = SerialEnd(), tmp_path_factory.mktemp("dev") / "ttyACM0"
    os.symlink(first.device, link_path)
    heartbeat = VEHICLE.heartbeat()
    async with guarded(f"serial://{link_path}:57600") as link:
        await arrives(link.mavsdk, heartbeat, lambda: first.send(heartbeat))
        first.close()
        second = SerialEnd()
        link_path.unlink()
        os.symlink(second.device, link_path)
        await arrives(link.mavsdk, heartbeat, lambda: second.send(heartbeat))
        second.close()


async def test_a_device_that_is_not_there_is_named() -> None:
    guard = LinkGuard(parse_connection("serial:///dev/no-such-device:57600"), SigningStore(), 0)
    with pytest.raises(LinkError, match="no-such-device"):
        await guard.open()


async def test_a_baud_rate_that_the_system_lacks_is_named() -> None:
    end = SerialEnd()
    guard = LinkGuard(parse_connection(f"serial://{end.device}:12345"), SigningStore(), 0)
    with pytest.raises(LinkError, match="12345 is no baud rate"):
        await guard.open()
    end.close()


async def test_a_tcp_peer_that_reads_nothing_gets_nothing_late() -> None:
    port = free_udp_ports(1)
    async with guarded(f"tcpin://{LOOPBACK}:{port}") as link:
        with socket.socket() as sock:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            sock.connect((LOOPBACK, port))
            heartbeat = VEHICLE.heartbeat()
            await arrives(link.mavsdk, heartbeat, lambda: sock.sendall(heartbeat))
            command = GROUND.command(1, 400, 1)
            async with asyncio.timeout(30.0):
                while not link.refused(RefusalKind.CONGESTED):
                    for _ in range(50):
                        link.mavsdk.send(command)
                    await asyncio.sleep(0.001)


async def test_a_tcp_connection_from_an_address_that_is_not_allowed_is_cut() -> None:
    port = free_udp_ports(1)
    async with guarded(f"tcpin://{LOOPBACK}:{port}?peer=10.0.0.0/8") as link:
        with socket.create_connection((LOOPBACK, port)) as sock:
            await until(lambda: link.refused(RefusalKind.PEER_NOT_ALLOWED) == 1, "it must be counted", 5.0)
            with pytest.raises(ConnectionResetError):
                await asyncio.to_thread(sock.recv, 1)


async def test_silent_tcp_connections_keep_no_vehicle_out_and_those_that_speak_stay() -> None:
    port = free_udp_ports(1)
    async with guarded(f"tcpin://{LOOPBACK}:{port}") as link:
        with ExitStack() as opened:
            for _ in range(40):
                opened.enter_context(socket.create_connection((LOOPBACK, port), source_address=(OTHER_ADDRESS, 0)))
                await asyncio.sleep(0)
            vehicle = TcpEnd(opened.enter_context(socket.create_connection((LOOPBACK, port))))
            heartbeat, position = VEHICLE.heartbeat(), VEHICLE.position()
            await arrives(link.mavsdk, heartbeat, lambda: vehicle.send(heartbeat))
            standby = TcpEnd(opened.enter_context(socket.create_connection((LOOPBACK, port))))

            def silent_are_cut() -> bool:
                for end in (vehicle, standby):
                    end.send(heartbeat)
                return link.refused(RefusalKind.NOT_ANNOUNCED) == 40

            await until(silent_are_cut, "silent ones must be cut", 20.0)
            await arrives(link.mavsdk, position, lambda: vehicle.send(position))
            standby.received()
            await until(lambda: bool(standby.received()), "another way to the vehicle must stay open", 5.0)


async def test_a_long_datagram_of_a_stranger_is_not_looked_at() -> None:
    async with udpin() as (link, vehicle):
        stranger = UdpEnd(vehicle.to, address=OTHER_ADDRESS)
        phantom = FrameSender(77).heartbeat()
        stranger.send(phantom * 100)
        await until(lambda: link.refused(RefusalKind.DAMAGED) == 1, "it must be refused", 5.0)
        await stays_silent(link.mavsdk, phantom)
        stranger.close()


async def test_a_frame_after_one_that_nobody_received_is_sent() -> None:
    vehicle = UdpEnd()
    port = vehicle.port
    async with guarded(f"udpout://{LOOPBACK}:{port}") as link:
        await until(lambda: bool(vehicle.received()), "a vehicle that waits must be greeted", 5.0)
        vehicle.close()
        client = UdpClient(LOOPBACK, port, link.guard)
        await client.open()
        (peer,) = client.awaiting_heartbeat()
        client.send(peer, GROUND.heartbeat())  # the answer is an error that the next call returns
        vehicle = UdpEnd(port=port)
        command = GROUND.command(1, 400, 1)
        client.send(peer, command)
        await arrives(vehicle, command)
        client.close()
        vehicle.close()


async def test_the_systems_that_were_refused_last_are_named() -> None:
    async with udpin("?system=1") as (link, vehicle):
        for number in range(2, 40):
            vehicle.send(FrameSender(number).heartbeat())
        await until(lambda: link.refused(RefusalKind.SYSTEM_NOT_ALLOWED) == 38, "all of them must be refused", 5.0)
        (refused,) = link.guard.refused()
        assert refused.systems == tuple(range(32, 40))


def is_made_of(heard: bytes, *frames: bytes) -> bool:
    """Whether nothing else was heard, each frame any number of times."""
    for frame in frames:
        heard = heard.replace(frame, b"")
    return heard == b""


async def test_while_the_loop_hangs_nothing_passes_and_nothing_of_it_comes_late() -> None:
    """Both ways: commands that wait here, and positions that would count as new."""
    async with udpin() as (link, vehicle):
        heartbeat = VEHICLE.heartbeat()
        await arrives(link.mavsdk, heartbeat, lambda: vehicle.send(heartbeat))
        opening = GROUND.command(1, 1)
        await arrives(vehicle, opening, lambda: link.mavsdk.send(opening))
        old = [GROUND.command(1, 400, number) for number in range(20)], [VEHICLE.position(n) for n in range(20)]
        for command, position in zip(*old, strict=True):
            link.mavsdk.send(command)
            vehicle.send(position)
        report = VEHICLE.text("reached")
        vehicle.send(report)
        time.sleep(1.0)  # noqa: ASYNC251  the loop hangs
        command, position = GROUND.command(1, 21), VEHICLE.position(99)
        told = await heard_until(vehicle, command, lambda: link.mavsdk.send(command))
        assert is_made_of(told, command, opening)
        told = await heard_until(link.mavsdk, position, lambda: vehicle.send(position))
        assert report in told, "a report that comes late is still news"
        assert is_made_of(told, report, position, heartbeat)
        assert link.refused(RefusalKind.LATE) >= 40


async def test_a_vehicle_whose_first_heartbeat_came_late_is_heard_at_once() -> None:
    async with udpin() as (link, vehicle):
        vehicle.send(VEHICLE.heartbeat())
        time.sleep(0.5)  # noqa: ASYNC251  the loop hangs
        await until(lambda: link.refused(RefusalKind.LATE) == 1, "it must count as late", 5.0)
        for _ in range(20):
            position = VEHICLE.position()
            await arrives(link.mavsdk, position, lambda position=position: vehicle.send(position))
        assert link.refused(RefusalKind.OTHER_PEER) == 0

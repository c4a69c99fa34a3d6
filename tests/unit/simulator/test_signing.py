"""A simulated vehicle signs, and checks signatures, as PX4 main does."""

from __future__ import annotations

import json
import random
import stat
import time
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common

from app.simulator.channel import Channel
from app.simulator.dialect import Message, mavlink
from app.simulator.faults import LinkFaults
from app.simulator.signing import VehicleSigning
from tests.support.mavlink_frames import FrameSender, timestamp_of
from tests.support.simulated_vehicle import GroundStation

KEY, NEXT_KEY = b"k" * 32, b"n" * 32
GROUND = ("127.0.0.1", 14550)


class Wire:
    """A channel without a socket: what it sends, and what it takes of what is sent to it."""

    def __init__(self, signing: VehicleSigning) -> None:
        self.received: list[Message] = []
        self.sent: list[bytes] = []
        take = lambda channel, message: self.received.append(message)  # noqa: E731
        self.channel = Channel(GROUND, LinkFaults(), random.Random(1), take, time.monotonic, signing=signing.link())
        self.channel.connection_made(self)  # type: ignore[arg-type]

    def sendto(self, data: bytes, _to: object) -> None:
        self.sent.append(data)

    def takes(self, frame: bytes) -> bool:
        before = len(self.received)
        self.channel.datagram_received(frame, GROUND)
        return len(self.received) > before

    def says(self) -> bytes:
        self.channel.send(mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3), 1, 1)
        return self.sent[-1]


def key_file(folder: Path, content: bytes) -> str:
    path = folder / "mavlink-signing-key.bin"
    path.write_bytes(content)
    return str(path)


def ground(key: bytes | None = KEY) -> FrameSender:
    return FrameSender(245, 190, key=key)


def test_without_a_key_nothing_is_signed_and_everything_taken() -> None:
    wire = Wire(VehicleSigning(1))
    assert wire.says()[2] == 0
    assert wire.takes(ground(None).command(1, 400))
    assert wire.takes(ground().command(1, 400)), "a signature that nobody can check is as good as none"


def test_with_a_key_everything_is_signed_and_only_that_taken(tmp_path: Path) -> None:
    wire = Wire(VehicleSigning(1, key_file(tmp_path, KEY)))
    assert wire.says()[2] == 1
    assert not wire.takes(ground(None).command(1, 400))
    assert not wire.takes(ground(NEXT_KEY).command(1, 400))
    assert wire.takes(ground().command(1, 400))
    assert wire.takes(ground(None).heartbeat()), "PX4 takes heartbeats unsigned"


def test_a_frame_that_was_taken_is_not_taken_again(tmp_path: Path) -> None:
    wire = Wire(VehicleSigning(1, key_file(tmp_path, KEY)))
    frame = ground().command(1, 400)
    assert wire.takes(frame)
    assert not wire.takes(frame)


def test_a_forged_timestamp_shuts_nobody_out(tmp_path: Path) -> None:
    wire = Wire(VehicleSigning(1, key_file(tmp_path, KEY)))
    assert wire.takes(ground().command(1, 400))
    future = FrameSender(245, 190, key=NEXT_KEY, timestamp=timestamp_of(time.time()) + 10**9)
    assert not wire.takes(future.command(1, 400))
    assert wire.takes(ground().command(1, 400))


def test_it_has_no_clock_and_takes_the_time_of_whom_it_hears(tmp_path: Path) -> None:
    signing = VehicleSigning(1, key_file(tmp_path, KEY + (777).to_bytes(8, "little")))
    wire = Wire(signing)
    assert int.from_bytes(wire.says()[-12:-6], "little") == 777
    wire.takes(ground().command(1, 400))
    assert int.from_bytes(wire.says()[-12:-6], "little") >= timestamp_of(time.time() - 5.0)
    signing.boot()
    assert int.from_bytes(wire.says()[-12:-6], "little") == 777


def test_it_finds_its_key_in_the_list_of_waydrop(tmp_path: Path) -> None:
    path = tmp_path / "link-keys.json"
    path.write_text(json.dumps({"vehicles": {"7": [{"secret": KEY.hex()}, {"secret": NEXT_KEY.hex()}]}}))
    assert Wire(VehicleSigning(7, str(path))).takes(ground().command(7, 400))
    with pytest.raises(ValueError, match="no key for system 1"):
        VehicleSigning(1, str(path))


@pytest.mark.parametrize("content", [b"", b"short", b"x" * 39], ids=str)
def test_a_file_that_holds_no_key_is_refused(tmp_path: Path, content: bytes) -> None:
    with pytest.raises(ValueError, match="no key"):
        VehicleSigning(1, key_file(tmp_path, content))


def setup(key: bytes, at: int = 5000) -> Message:
    return common.MAVLink_setup_signing_message(1, 1, list(key), at)


def test_setup_signing_gives_a_key_that_outlives_a_restart(tmp_path: Path) -> None:
    file = str(tmp_path / "mavlink-signing-key.bin")
    signing = VehicleSigning(1, file)
    wire = Wire(signing)
    assert wire.takes(ground(None).pack(setup(KEY)))
    _, text = signing.on_setup(wire.received[-1], armed=False)
    assert text == "MAVLink signing key accepted"
    assert wire.says()[2] == 1
    assert stat.S_IMODE(Path(file).stat().st_mode) == 0o600
    again = Wire(VehicleSigning(1, file))
    assert not again.takes(ground(None).command(1, 400))
    assert again.takes(ground().command(1, 400))


def test_a_key_is_changed_and_taken_away_by_who_has_it(tmp_path: Path) -> None:
    signing = VehicleSigning(1, key_file(tmp_path, KEY))
    wire = Wire(signing)
    assert not wire.takes(ground(None).pack(setup(NEXT_KEY)))
    assert wire.takes(ground().pack(setup(NEXT_KEY)))
    signing.on_setup(wire.received[-1], armed=False)
    assert not wire.takes(ground().command(1, 400))
    assert wire.takes(ground(NEXT_KEY).command(1, 400))
    assert wire.takes(ground(NEXT_KEY).pack(setup(bytes(32), 0)))
    assert signing.on_setup(wire.received[-1], armed=False)[1] == "MAVLink signing disabled"
    assert wire.says()[2] == 0


def test_an_armed_vehicle_keeps_its_key(tmp_path: Path) -> None:
    signing = VehicleSigning(1, key_file(tmp_path, KEY))
    wire = Wire(signing)
    wire.takes(ground().pack(setup(NEXT_KEY)))
    assert signing.on_setup(wire.received[-1], armed=True)[1] == "MAVLink signing: rejected while armed"
    assert wire.takes(ground().command(1, 400))


@pytest.mark.parametrize(("firmware", "signs"), [("px4-main", True), ("px4-1.14", False)])
def test_older_firmware_knows_no_setup_signing(firmware: str, signs: bool) -> None:
    quad = GroundStation(firmware=firmware)
    quad.send(mavlink.MAVLink_setup_signing_message(1, 1, list(KEY), 5000))
    quad.fly(0.2)
    texts = [received.message.text for received in quad.received if received.name == "STATUSTEXT"]
    assert any("key accepted" in text for text in texts) is signs

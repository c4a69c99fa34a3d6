"""Connection URLs with the guard's options: what they mean, and that a wrong one is named."""

from __future__ import annotations

import pytest

from app.domain.errors import LinkError
from app.vehicles.link_guard.options import MOST_SYSTEMS, ConnectionOptions, parse_connection


def test_a_url_without_options_pins_the_first_peer() -> None:
    found = parse_connection("udpin://0.0.0.0:14540")
    assert (found.scheme, found.host, found.port) == ("udpin", "0.0.0.0", 14540)
    assert found.options == ConnectionOptions()
    assert found.options.most_systems == MOST_SYSTEMS
    assert found.options.allows("192.168.7.7")


def test_options_stand_behind_a_question_mark_and_are_no_part_of_the_name() -> None:
    found = parse_connection("tcpin://[::1]:5760?peer=10.8.0.0/24&peer=fd00::7&system=1&system=7&link_id=9&signing=off")
    assert found.name == "tcpin://[::1]:5760"
    assert found.options.systems == {1, 7}
    assert found.options.link_id == 9
    assert not found.options.signing
    for address, allowed in (("10.8.0.99", True), ("10.9.0.1", False), ("fd00::7", True), ("::ffff:10.8.0.1", True)):
        assert found.options.allows(address) is allowed, address


def test_a_serial_device_has_a_baud_rate() -> None:
    found = parse_connection("serial:///dev/ttyACM0:57600?system=3")
    assert (found.host, found.port, found.name) == ("/dev/ttyACM0", 57600, "serial:///dev/ttyACM0:57600")


@pytest.mark.parametrize(
    ("url", "why"),
    [
        ("udp://127.0.0.1:14540", "scheme"),
        ("raw://", "scheme"),
        ("udpin://127.0.0.1", "no port"),
        ("udpin://localhost:14540", "numbers"),
        ("udpin://127.0.0.1:99999", "Port out"),
        ("udpin://0.0.0.0:14540?peer=vehicle", "neither an address"),
        ("udpin://0.0.0.0:14540?peer=any&peer=10.0.0.1", "everybody"),
        ("udpin://0.0.0.0:14540?system=0", "1 to 255"),
        ("udpin://0.0.0.0:14540?system=256", "1 to 255"),
        ("udpin://0.0.0.0:14540?most_systems=x", "no number"),
        ("udpin://0.0.0.0:14540?pear=10.0.0.1", "no option"),
        ("udpin://0.0.0.0:14540?signing=maybe", "no option"),
        ("serial:///dev/ttyACM0", "baud"),
        ("serial://ttyACM0:57600", "baud"),
        ("serial:///dev/ttyACM0:57600?peer=10.0.0.1", "no peers"),
    ],
)
def test_what_cannot_work_is_refused_with_its_reason(url: str, why: str) -> None:
    with pytest.raises(LinkError, match=why) as caught:
        parse_connection(url)
    assert repr(url) in caught.value.detail
    assert "peer=" in caught.value.hint

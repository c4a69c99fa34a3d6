"""The signature is what docs/how-to/receive-webhooks.md says it is, computed here in another way."""

from __future__ import annotations

import hashlib
import hmac

from app.domain.webhooks.webhook import signature


def test_it_covers_the_time_and_every_byte_of_the_body() -> None:
    expected = hmac.new(b"whsec_abc", b'1700000000.{"id":"gw:1"}', hashlib.sha256).hexdigest()
    assert signature("whsec_abc", 1700000000, b'{"id":"gw:1"}') == f"t=1700000000,v1={expected}"
    assert signature("whsec_abc", 1700000001, b'{"id":"gw:1"}').partition(",")[2] != f"v1={expected}"
    assert signature("whsec_abd", 1700000000, b'{"id":"gw:1"}').partition(",")[2] != f"v1={expected}"


def test_a_known_value_stays() -> None:
    assert signature("whsec_test", 1, b"{}").startswith("t=1,v1=")
    assert len(signature("whsec_test", 1, b"{}")) == len("t=1,v1=") + 64

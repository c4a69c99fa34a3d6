"""Messages are signed as Standard Webhooks says: a receiver's own library accepts them, and nothing altered."""

from __future__ import annotations

import base64
import time

import pytest
from standardwebhooks import Webhook, WebhookVerificationError

from app.domain.webhooks.webhook import ID, SIGNATURE, TIMESTAMP, signed_headers

SECRET = "whsec_" + base64.b64encode(bytes(range(32))).decode()
BODY = '{"id":"gw:1","note":"Zürich"}'.encode()


def test_a_receivers_library_accepts_it() -> None:
    headers = signed_headers(SECRET, "gw:1", time.time(), BODY)
    assert Webhook(SECRET).verify(BODY, headers)["id"] == "gw:1"


@pytest.mark.parametrize("altered", [ID, TIMESTAMP, SIGNATURE, "body", "secret"])
def test_nothing_altered_is_accepted(altered: str) -> None:
    now = time.time()
    headers = signed_headers(SECRET, "gw:1", now, BODY)
    changed = {ID: "gw:2", TIMESTAMP: str(int(now) + 1), SIGNATURE: f"v1,{'A' * 43}="}
    given = {**headers, altered: changed[altered]} if altered in changed else headers
    body = BODY.replace(b"gw:1", b"gw:2") if altered == "body" else BODY
    secret = "whsec_" + base64.b64encode(bytes(32)).decode() if altered == "secret" else SECRET
    with pytest.raises(WebhookVerificationError):
        Webhook(secret).verify(body, given)


def test_a_known_value_stays() -> None:
    headers = signed_headers(SECRET, "gw:1", 1_700_000_000.9, b"{}")
    assert headers[TIMESTAMP] == "1700000000"
    assert headers[SIGNATURE] == "v1,/1EbxktENGE5Cnq8Tzs2KmXsg33E8tqJCMWKAjevO9o="

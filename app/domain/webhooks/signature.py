"""How a receiver knows that a message is Waydrop's, unaltered and not an old one sent again."""

from __future__ import annotations

import hashlib
import hmac
from typing import Final

SIGNATURE: Final = "Waydrop-Signature"
EVENT: Final = "Waydrop-Event"
WEBHOOK: Final = "Waydrop-Webhook"
SECRET_PREFIX: Final = "whsec_"


def signature(secret: str, timestamp: int, body: bytes) -> str:
    """The header's value, `t=TIMESTAMP,v1=HEX`: HMAC-SHA256 with the secret as it is over `TIMESTAMP.` and the body.

    `timestamp` is Unix seconds of this attempt. A receiver refuses old ones, so that nobody can repeat a message later.
    """
    signed = hmac.new(secret.encode("ascii"), str(timestamp).encode("ascii") + b"." + body, hashlib.sha256)
    return f"t={timestamp},v1={signed.hexdigest()}"

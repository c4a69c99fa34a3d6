"""A NATS credentials file (`.creds`): who the client is, and the key that proves it.

nats-py reads these files with a library of its own for the key, and for ever if there is nothing in them.
"""

from __future__ import annotations

import base64
import binascii
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from nats.errors import InvalidUserCredentialsError

_CLAIMS: Final = re.compile(rb"-+BEGIN NATS USER JWT-+\s+(\S+)\s+-+END")
_SEED: Final = re.compile(rb"-+BEGIN USER NKEY SEED-+\s+([A-Z2-7]{58})\s+-+END")
_SEED_KIND: Final = 18 << 3


@dataclass(frozen=True, slots=True)
class Credentials:
    """`claims` is the token that names the user."""

    claims: bytes
    key: Ed25519PrivateKey

    def sign(self, nonce: str) -> bytes:
        """The answer to a server's challenge."""
        return base64.b64encode(self.key.sign(nonce.encode()))


def read_credentials(path: Path) -> Credentials:
    """Raises OSError, and InvalidUserCredentialsError if it is no credentials file. nats-py tries again after both."""
    text = path.read_bytes()
    claims, seed = _CLAIMS.search(text), _SEED.search(text)
    if claims is None or seed is None:
        raise InvalidUserCredentialsError
    raw = base64.b32decode(seed[1] + b"======")
    if raw[0] & 0xF8 != _SEED_KIND or binascii.crc_hqx(raw[:-2], 0).to_bytes(2, "little") != raw[-2:]:
        raise InvalidUserCredentialsError
    return Credentials(claims[1], Ed25519PrivateKey.from_private_bytes(raw[2:34]))

"""An operator, an account and a user of NATS: what `nsc` makes, for servers that know users by signed claims."""

from __future__ import annotations

import base64
import binascii
import json
import time
from pathlib import Path
from typing import Any, Final

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

OPERATOR: Final = 14 << 3
ACCOUNT: Final = 0
USER: Final = 20 << 3
SEED: Final = 18 << 3


def _encoded(data: bytes) -> str:
    return base64.b32encode(data + binascii.crc_hqx(data, 0).to_bytes(2, "little")).decode().rstrip("=")


class Party:
    """Somebody with a key, who signs claims about others."""

    def __init__(self, kind: int) -> None:
        self._kind = kind
        self._key = Ed25519PrivateKey.generate()
        self.name: Final = _encoded(bytes([kind]) + self._key.public_key().public_bytes_raw())

    @property
    def seed(self) -> str:
        """The private key."""
        return _encoded(bytes([SEED | self._kind >> 5, (self._kind & 31) << 3]) + self._key.private_bytes_raw())

    def claim(self, about: Party, **nats: Any) -> str:
        """A signed token."""
        claims = {"iss": self.name, "sub": about.name, "iat": int(time.time()), "name": "test", "jti": about.name}
        head = {"typ": "JWT", "alg": "ed25519-nkey"}
        text = ".".join(_part(json.dumps(part).encode()) for part in (head, {**claims, "nats": {"version": 2, **nats}}))
        return f"{text}.{_part(self._key.sign(text.encode()))}"


def _part(data: bytes) -> str:
    return base64.urlsafe_b64encode(data).decode().rstrip("=")


def write_nats_user(folder: Path) -> tuple[Path, Path]:
    """A configuration of a server whose users need claims, and the credentials file of one user."""
    operator, system, account, user = Party(OPERATOR), Party(ACCOUNT), Party(ACCOUNT), Party(USER)
    limits = dict.fromkeys(("subs", "data", "payload", "imports", "exports", "conn", "leaf"), -1)
    accounts = "".join(
        f"  {one.name}: {operator.claim(one, type='account', limits=limits)}\n" for one in (system, account)
    )
    config, credentials = folder / "nats.conf", folder / "user.creds"
    config.write_text(
        f"operator: {operator.claim(operator, type='operator')}\n"
        f"system_account: {system.name}\nresolver: MEMORY\nresolver_preload: {{\n{accounts}}}\n"
    )
    claims = account.claim(user, type="user", subs=-1, data=-1, payload=-1)
    credentials.write_text(
        f"-----BEGIN NATS USER JWT-----\n{claims}\n------END NATS USER JWT------\n\n"
        f"-----BEGIN USER NKEY SEED-----\n{user.seed}\n------END USER NKEY SEED------\n"
    )
    return config, credentials

"""The signing keys of the vehicles: which there are, and which of them each vehicle is known to use."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from app.vehicles.link_guard.signing import SigningKey, is_signed_by


@dataclass(frozen=True, slots=True)
class StoredKey:
    """A key as the key file has it. `in_use`: the operator says that the vehicle has it, also before it is heard."""

    key: SigningKey
    in_use: bool = False
    created: str = ""


class VehicleKeys:
    """The keys of one system, oldest first. The vehicle is known to use `current`; younger ones wait for it to switch.

    While none is in use the vehicle is heard unsigned: a key that was just made is on no vehicle yet.
    """

    def __init__(self, keys: Sequence[StoredKey], used: frozenset[str]) -> None:
        """`used`: fingerprints of keys that this vehicle was heard to sign with."""
        seen = [at for at, stored in enumerate(keys) if stored.in_use or stored.key.fingerprint in used]
        self._keys = [stored.key for stored in keys[seen[-1] if seen else 0 :]]
        self.required = bool(seen)

    @property
    def current(self) -> SigningKey | None:
        """What frames to the vehicle are signed with; None while it uses none."""
        return self._keys[0] if self.required else None

    @property
    def newest(self) -> SigningKey:
        """What it is given next."""
        return self._keys[-1]

    def __iter__(self) -> Iterator[SigningKey]:
        """Oldest first."""
        return iter(self._keys)

    def find(self, frame: bytes) -> SigningKey | None:
        """The key that made a frame's signature; None: none of these."""
        return next((key for key in self._keys if is_signed_by(frame, key)), None)

    def verified(self, key: SigningKey) -> bool:
        """The vehicle signs with this key: older ones count no more. Whether that is news."""
        if self.required and key is self._keys[0]:
            return False
        del self._keys[: self._keys.index(key)]
        self.required = True
        return True


class KeyRing:
    """The keys of all systems."""

    def __init__(self, keys: Mapping[int, Sequence[StoredKey]], used: Mapping[int, str] | None = None) -> None:
        """`used`: by system id, the fingerprint of the newest key that it was heard to sign with."""
        self._used = dict(used or {})
        self.replace(keys)

    def replace(self, keys: Mapping[int, Sequence[StoredKey]]) -> None:
        """The key file was read again."""
        self._of = {
            number: VehicleKeys(stored, frozenset(filter(None, [self._used.get(number)])))
            for number, stored in keys.items()
            if stored
        }

    def signing_keys(self) -> Iterator[SigningKey]:
        """All that a vehicle may sign with."""
        for keys in self._of.values():
            yield from keys

    def of(self, number: int) -> VehicleKeys | None:
        """The keys of one system; None: it has none."""
        return self._of.get(number)

    def verified(self, number: int, key: SigningKey) -> bool:
        """This system signed with this key. Whether that is news, to be stored."""
        is_news = self._of[number].verified(key)
        if is_news:
            self._used[number] = key.fingerprint
        return is_news

    def used(self) -> dict[int, str]:
        """By system id, the fingerprint of the newest key that it was heard to sign with."""
        return dict(self._used)

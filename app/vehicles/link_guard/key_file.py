"""The files of the signing keys: the keys, which the operator makes, and what the service remembers of their use.

Both are readable by their owner alone. The first is written by the command line, the second by the service.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import secrets
import stat
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Final

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from app.domain.ports.link_keys import LinkKey, LinkKeyError
from app.vehicles.link_guard.keyring import StoredKey
from app.vehicles.link_guard.signing import KEY_BYTES, SigningKey, StreamKey

MOST_KEYS: Final = 2
"""Of one vehicle: the one it uses, and the one it is given next."""


def _secret(text: str) -> str:
    SigningKey(bytes.fromhex(text))
    return text


class _Entry(BaseModel):
    model_config = ConfigDict(extra="forbid", hide_input_in_errors=True)

    secret: Annotated[str, AfterValidator(_secret)] = Field(repr=False)
    in_use: bool = False
    created: str = ""


class _Keys(BaseModel):
    model_config = ConfigDict(extra="forbid", hide_input_in_errors=True)

    version: int = Field(default=1, ge=1, le=1)
    vehicles: dict[Annotated[int, Field(ge=1, le=255)], list[_Entry]] = Field(default_factory=dict)


Keys = dict[int, list[StoredKey]]
"""By system id, oldest first."""


class KeyFile:
    """`link-keys.json`. A file that others can read is refused: whoever has read it can fly the vehicles."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def read(self) -> Keys:
        """All keys; none if there is no file. Raises LinkKeyError."""
        try:
            handle = os.open(self.path, os.O_RDONLY | os.O_CLOEXEC)
        except FileNotFoundError:
            return {}
        except OSError as error:
            raise LinkKeyError(f"cannot read {self.path}: {error.strerror}") from error
        with open(handle, encoding="utf-8") as file:
            self._refuse_shared(os.fstat(handle))
            try:
                found = _Keys.model_validate_json(file.read())
            except OSError as error:
                raise LinkKeyError(f"cannot read {self.path}: {error.strerror}") from error
            except (ValidationError, UnicodeDecodeError) as error:
                raise LinkKeyError(
                    f"{self.path} is no file of link keys: {_where(error)}",
                    hint="make it with `waydrop link-key create`",
                ) from error
        return {
            number: [StoredKey(SigningKey(bytes.fromhex(e.secret)), e.in_use, e.created) for e in entries]
            for number, entries in found.vehicles.items()
        }

    def version(self) -> tuple[int, ...] | None:
        """Changes whenever the file is written, or who may read it; None: there is none."""
        try:
            found = self.path.stat()
        except OSError:
            return None
        return found.st_mtime_ns, found.st_ctime_ns, found.st_ino

    def add(self, number: int, secret: bytes | None = None) -> StoredKey:
        """A new key for a system: a random one, or `secret`, which the vehicle is said to use already.

        Raises LinkKeyError: it has two keys already, or has this one.
        """
        key = StoredKey(
            SigningKey(secret or secrets.token_bytes(KEY_BYTES)),
            in_use=secret is not None,
            created=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        )
        with self._changing() as keys:
            own = keys.setdefault(number, [])
            if any(other.key == key.key for other in own):
                raise LinkKeyError(f"system {number} has this key already")
            if len(own) >= MOST_KEYS:
                raise LinkKeyError(
                    f"system {number} has {MOST_KEYS} keys already",
                    hint=f"remove one it does not use: `waydrop link-key remove {number} FINGERPRINT`",
                )
            own.append(key)
        return key

    def remove(self, number: int, fingerprint: str) -> None:
        """Forget a key. Raises LinkKeyError if there is none."""
        with self._changing() as keys:
            own = keys.get(number, [])
            left = [stored for stored in own if stored.key.fingerprint != fingerprint]
            if len(left) == len(own):
                known = ", ".join(stored.key.fingerprint for stored in own) or "none"
                raise LinkKeyError(f"system {number} has no key {fingerprint}", hint=f"its keys: {known}")
            keys[number] = left

    @contextlib.contextmanager
    def _changing(self) -> Iterator[Keys]:
        """Read, change, write: one at a time, and never half. Raises LinkKeyError."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            lock = os.open(self.path.with_suffix(".lock"), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError as error:
            raise self._not_writable(error) from error
        try:
            fcntl.flock(lock, fcntl.LOCK_EX)
            keys = self.read()
            yield keys
            self._write(keys)
        except OSError as error:
            raise self._not_writable(error) from error
        finally:
            os.close(lock)

    def _write(self, keys: Keys) -> None:
        vehicles = {
            number: [
                _Entry(secret=stored.key.secret.hex(), in_use=stored.in_use, created=stored.created) for stored in own
            ]
            for number, own in sorted(keys.items())
            if own
        }
        write_private(self.path, _Keys(vehicles=vehicles).model_dump_json(indent=2))

    def _not_writable(self, error: OSError) -> LinkKeyError:
        return LinkKeyError(
            f"cannot write {self.path}: {error.strerror or error}", hint="give your user write access to its folder"
        )

    def _refuse_shared(self, found: os.stat_result) -> None:
        if found.st_mode & (stat.S_IRWXG | stat.S_IRWXO):
            raise LinkKeyError(
                f"{self.path} can be read or written by others (mode {stat.S_IMODE(found.st_mode):04o})",
                hint=f"chmod 600 {self.path}; if others had access, give the vehicles new keys",
            )
        if found.st_uid not in (os.getuid(), 0):
            raise LinkKeyError(f"{self.path} belongs to another user", hint="let it belong to the service's user")


def _where(error: ValidationError | UnicodeDecodeError) -> str:
    if isinstance(error, UnicodeDecodeError):
        return "it is not UTF-8"
    first = error.errors(include_url=False, include_input=False, include_context=False)[0]
    place = "/".join(str(part) for part in first["loc"])
    return f"{place}: {first['msg']}" if place else str(first["msg"])


def write_private(path: Path, text: str) -> None:
    """Replace a file by one that its owner alone can read; on the disk when this returns. Raises OSError."""
    fresh = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    try:
        with open(os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600), "w") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(path)
    except OSError:
        fresh.unlink(missing_ok=True)
        raise
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


@dataclass(frozen=True, slots=True)
class SigningMemory:
    """`reserved`: by the key's fingerprint, before which no timestamp may be sent. `streams`: the last one accepted of
    each. `used`: by system id, the fingerprint of its key.
    """

    reserved: Mapping[str, int] = field(default_factory=dict)
    streams: Mapping[StreamKey, int] = field(default_factory=dict)
    used: Mapping[int, str] = field(default_factory=dict)


class MemoryFile:
    """`link-state.json`."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def read(self) -> SigningMemory:
        """What was remembered; nothing if there is no file.

        Raises LinkKeyError: it cannot be read. To go on without it would let recordings pass.
        """
        try:
            found = json.loads(self.path.read_text(encoding="utf-8"))
            streams = {
                StreamKey(str(key), int(s), int(c), int(link)): int(last) for key, s, c, link, last in found["streams"]
            }
            used = {int(number): str(fingerprint) for number, fingerprint in found["used"].items()}
            reserved = {str(fingerprint): int(last) for fingerprint, last in found["reserved"].items()}
            return SigningMemory(reserved, streams, used)
        except FileNotFoundError:
            return SigningMemory()
        except (OSError, ValueError, OverflowError, KeyError, TypeError, AttributeError) as error:
            raise LinkKeyError(
                f"cannot read {self.path}: {error}",
                hint="restore it; without it a recording of an earlier flight could be taken for the vehicle",
            ) from error

    def write(self, memory: SigningMemory) -> None:
        """Remember. Raises OSError."""
        streams = [[*stream, last] for stream, last in memory.streams.items()]
        used = {str(number): fingerprint for number, fingerprint in memory.used.items()}
        write_private(self.path, json.dumps({"reserved": dict(memory.reserved), "streams": streams, "used": used}))


class LinkKeyFiles:
    """LinkKeys in these files."""

    def __init__(self, keys: KeyFile, memory: MemoryFile) -> None:
        self._keys = keys
        self._memory = memory

    def create(self, system_id: int, secret: bytes | None = None) -> LinkKey:
        stored = self._keys.add(system_id, secret)
        return LinkKey(system_id, stored.key.fingerprint, stored.created, stored.in_use)

    def list_keys(self) -> Sequence[LinkKey]:
        used = self._memory.read().used
        return [
            LinkKey(
                number,
                stored.key.fingerprint,
                stored.created,
                stored.in_use or used.get(number) == stored.key.fingerprint,
            )
            for number, own in sorted(self._keys.read().items())
            for stored in own
        ]

    def remove(self, system_id: int, fingerprint: str) -> None:
        self._keys.remove(system_id, fingerprint)

"""TLS: the certificate of the service, loaded again when its files are replaced."""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import structlog

from app.domain.errors import WaydropError
from app.services.background import background

log = structlog.get_logger(__name__)

LOOK_EVERY_S: Final = 60.0
Stamps = tuple[tuple[int, int], ...]
"""Time of change and inode of each file."""


class ListenError(WaydropError, code="listen.failed"):
    """The service cannot listen on the address, or not with the certificate."""


@dataclass(frozen=True, slots=True)
class TlsFiles:
    """PEM files: the certificate with its chain, and its private key. They are compared every `look_every_s`."""

    certificate: Path
    key: Path
    look_every_s: float = LOOK_EVERY_S


@dataclass(slots=True)
class Certificate:
    """The certificate in use: the context of the next connection."""

    context: ssl.SSLContext


@asynccontextmanager
async def certificate(files: TlsFiles | None) -> AsyncIterator[Certificate | None]:
    """The certificate of a server, or None without files. A replaced one is used for new connections.

    Raises:
        ListenError: the files cannot be read, or do not fit each other.
    """
    if files is None:
        yield None
        return
    known = await asyncio.to_thread(_stamps, files)  # before they are loaded: no replacement may be missed
    used = Certificate(await asyncio.to_thread(_loaded, files))
    async with background(_follow(used, files, known), "tls certificate"):
        yield used


async def _follow(used: Certificate, files: TlsFiles, known: Stamps) -> None:
    while True:
        await asyncio.sleep(files.look_every_s)
        found = await asyncio.to_thread(_stamps, files)
        if found == known:
            continue
        try:
            used.context = await asyncio.to_thread(_loaded, files)
        except ListenError as error:
            log.error("the new certificate cannot be used, the old one stays", error=error.detail)
        else:
            log.info("new certificate", file=str(files.certificate))
            known = found


def _stamps(files: TlsFiles) -> Stamps:
    """What changes when a file is replaced. A file that is missing at the moment has none."""
    found = []
    for path in (files.certificate, files.key):
        try:
            entry = path.stat()
        except OSError:
            found.append((0, 0))
        else:
            found.append((entry.st_mtime_ns, entry.st_ino))
    return tuple(found)


def _loaded(files: TlsFiles) -> ssl.SSLContext:
    """A new context: one that is loaded twice keeps the old certificate beside a new one with another type of key.

    Raises ListenError.
    """
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.set_alpn_protocols(["http/1.1"])
    try:
        # without a password an encrypted key would be asked for on the terminal
        context.load_cert_chain(files.certificate, files.key, password=lambda: "")
    except OSError as error:  # ssl.SSLError is one
        raise ListenError(
            f"the certificate {files.certificate} cannot be used with the key {files.key}: {_reason(error)}",
            hint="WAYDROP_TLS_CERT is the certificate with its chain, WAYDROP_TLS_KEY its private key without a "
            "password, both PEM files that the user that runs Waydrop can read",
        ) from error
    return context


def _reason(error: OSError) -> str:
    if isinstance(error, ssl.SSLError):
        return (error.reason or "no PEM file, or an encrypted key").replace("_", " ").lower()
    return error.strerror or str(error)

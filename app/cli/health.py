"""`waydrop health`: whether the service that has these settings is ready, for the health checks of containers."""

from __future__ import annotations

import http.client
import ipaddress
import ssl
from contextlib import closing
from typing import Annotated, Final

import typer

from app.cli.terminal import ServerRefusedError, ServerUnreachableError
from app.cli.variables import variable

TIMEOUT_S: Final = 5.0


def _host() -> str:
    return variable("WAYDROP_HOST") or "127.0.0.1"


def _port() -> str:
    return variable("WAYDROP_PORT") or "8080"


HostOption = Annotated[
    str,
    typer.Option(
        "--host", default_factory=_host, show_default=False, help="Address that it listens on; default: WAYDROP_HOST."
    ),
]
PortOption = Annotated[
    int,
    typer.Option(
        "--port",
        min=0,
        max=65535,
        default_factory=_port,
        show_default=False,
        help="Port that it listens on; default: WAYDROP_PORT.",
    ),
]


def health(host: HostOption, port: PortOption) -> None:
    """Ask the Waydrop of these settings whether it is ready, for health checks."""
    address = _address(host.strip())
    try:
        with closing(_connection(address, port)) as connection:  # http.client: it knows no proxies
            connection.request("GET", "/readyz")
            status = connection.getresponse().status
    except (OSError, http.client.HTTPException) as error:
        raise ServerUnreachableError(f"Waydrop does not respond at port {port} of {address}: {error}") from error
    if status != http.HTTPStatus.OK:
        raise ServerRefusedError("service.not_ready", f"/readyz answers {status}", status=status)


def _connection(address: str, port: int) -> http.client.HTTPConnection:
    if not variable("WAYDROP_TLS_CERT"):
        return http.client.HTTPConnection(address, port, timeout=TIMEOUT_S)
    # the certificate is for the name that clients use, and nothing secret is sent
    unchecked = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    unchecked.check_hostname, unchecked.verify_mode = False, ssl.CERT_NONE
    return http.client.HTTPSConnection(address, port, timeout=TIMEOUT_S, context=unchecked)


def _address(host: str) -> str:
    """Where a service that listens on `host` is reached from this machine."""
    try:
        listening = ipaddress.ip_address(host)
    except ValueError:
        return host
    if not listening.is_unspecified:
        return host
    return "127.0.0.1" if listening.version == 4 else "::1"

"""`waydrop health`: whether the service that has these settings is ready, for the health checks of containers."""

from __future__ import annotations

import http.client
import ipaddress
import ssl
from contextlib import closing
from typing import Final

from app.cli.serve import HostOption, PortOption
from app.cli.terminal import ServerRefusedError, ServerUnreachableError
from app.config import Settings, load_settings

TIMEOUT_S: Final = 5.0


def health(host: HostOption = None, port: PortOption = None) -> None:
    """Ask the Waydrop of these settings whether it is ready, for health checks."""
    settings = load_settings(host=host, port=port)
    try:
        with closing(_connection(settings)) as connection:  # http.client: it knows no proxies
            connection.request("GET", "/readyz")
            status = connection.getresponse().status
    except (OSError, http.client.HTTPException) as error:
        raise ServerUnreachableError(
            f"Waydrop does not respond at port {settings.port} of {_address(settings.host)}: {error}"
        ) from error
    if status != http.HTTPStatus.OK:
        raise ServerRefusedError("service.not_ready", f"/readyz answers {status}", status=status)


def _connection(settings: Settings) -> http.client.HTTPConnection:
    address = _address(settings.host)
    if settings.tls_cert is None:
        return http.client.HTTPConnection(address, settings.port, timeout=TIMEOUT_S)
    # the certificate is for the name that clients use, and nothing secret is sent
    unchecked = ssl.create_default_context()
    unchecked.check_hostname, unchecked.verify_mode = False, ssl.CERT_NONE
    return http.client.HTTPSConnection(address, settings.port, timeout=TIMEOUT_S, context=unchecked)


def _address(host: str) -> str:
    """Where a service that listens on `host` is reached from this machine."""
    try:
        listening = ipaddress.ip_address(host)
    except ValueError:
        return host
    if not listening.is_unspecified:
        return host
    return "127.0.0.1" if listening.version == 4 else "::1"

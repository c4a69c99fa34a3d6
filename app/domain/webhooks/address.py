"""Where a webhook may lead: Waydrop sends to it from inside its own network, so not everything is taken."""

from __future__ import annotations

import ipaddress
from typing import Final

from pydantic import HttpUrl, TypeAdapter, ValidationError

from app.domain.errors import InvalidInputError

MAX_URL_CHARS: Final = 2000
_URL: Final = TypeAdapter(HttpUrl)


def checked_url(url: str, *, http_anywhere: bool) -> str:
    """The URL in its normal form.

    Raises:
        InvalidInputError: it is no http(s) URL, has a user name or a fragment, or is plain http to another machine and
            `http_anywhere` is not set.
    """
    try:
        parsed = _URL.validate_python(url.strip())
    except ValidationError as error:
        raise InvalidInputError(
            "url: this is no http or https address", hint="write it as https://dispatch.example/waydrop"
        ) from error
    if len(str(parsed)) > MAX_URL_CHARS:
        raise InvalidInputError(f"url: longer than {MAX_URL_CHARS} characters", hint="use a shorter one")
    if parsed.username or parsed.password or parsed.fragment is not None:
        raise InvalidInputError(
            "url: a user name, password or fragment is not taken",
            hint="the signature shows who sends; put a token into the path if the receiver needs one",
        )
    host = parsed.host or ""
    if parsed.scheme == "http" and not http_anywhere and not is_loopback(host):
        raise InvalidInputError(
            f"url: plain http to {host} could be read and altered on the way",
            hint="use https; WAYDROP_WEBHOOK_HTTP_ANYWHERE=true allows http to other machines",
        )
    return str(parsed)


def is_loopback(host: str) -> bool:
    """Whether a URL's host is this machine by its name or address."""
    try:
        return host == "localhost" or ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def host_of(url: str) -> str:
    """The host of a checked URL: the rest may be secret, and is not written to the journal."""
    return _URL.validate_python(url).host or ""

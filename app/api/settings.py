"""Settings of the API."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from app.api.proxies import Network


@dataclass(frozen=True, slots=True, kw_only=True)
class MapSettings:
    """The maps that the page may show under its own grid.

    `tile_url` or `tile_file` provides map tiles, with the attribution to display. `styles` are the addresses of a
    MapLibre style for the light and the dark theme, which the page offers and requests once a user has chosen it;
    `origins` are further servers that a style uses. `satellite_url` provides pictures, also on request.
    """

    tile_url: str | None = None
    tile_file: Path | None = None
    tile_attribution: str = ""
    styles: tuple[str, str] | None = None
    origins: tuple[str, ...] = ()
    satellite_url: str | None = None
    satellite_attribution: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ApiSettings:
    """`gateway` and `version` are reported to clients. `web_root` is the folder of the built page, None without one.

    `allowed_hosts` are accepted Host names (without port) besides the loopback names. `allowed_origins` are web origins
    (`https://desk.example`) that may send commands and open sockets, besides the service's own.

    `trusted_proxies` are the networks of proxies whose X-Forwarded-For is believed.

    `telemetry_period_s` is how often the stream sends the states of the vehicles.

    `bodies_under_way_bytes` limits the total size of large request bodies in progress.

    Sockets: at most `max_sockets` per path and `max_sockets_per_token` per token. At most `max_refused_sockets` more
    are accepted only to send the close code of a rejection; any beyond are rejected by HTTP status. Each socket queues
    up to `socket_queue` events. A client is disconnected if its queue overflows or one write exceeds `send_timeout_s`.
    Tokens are checked again every `access_again_s`; a revoked token closes its sockets. `socket_buffer_bytes` sets the
    kernel's send buffer.
    """

    gateway: str
    version: str
    web_root: Path | None = None
    maps: MapSettings = MapSettings()
    allowed_hosts: tuple[str, ...] = ()
    allowed_origins: tuple[str, ...] = ()
    trusted_proxies: tuple[Network, ...] = ()
    telemetry_period_s: float = 0.2
    max_body_bytes: int = 1024 * 1024
    body_timeout_s: float = 30.0
    bodies_under_way_bytes: int = 64 * 1024 * 1024
    max_sockets: int = 256
    max_sockets_per_token: int = 64
    max_refused_sockets: int = 16
    socket_queue: int = 1024
    socket_buffer_bytes: int = 256 * 1024
    send_timeout_s: float = 10.0
    heartbeat_s: float = 20.0
    access_again_s: float = 5.0
    close_grace_s: float = 2.0
    replay_page_events: int = 500
    recent_runs: int = 20

"""What can be configured of the API."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class ApiSettings:
    """`gateway` and `version` are told to clients; `web_root` is the folder of the built page, None without one.
    `tile_url` or `tile_file` is the map under it, with the words that it must show of its makers.

    `allowed_hosts` are Host names (no port) besides the loopback names; `allowed_origins` are web origins
    (`https://desk.example`) besides the service's own that may send commands and open sockets.

    Large bodies that are being read or worked on have `bodies_under_way_bytes` together.

    Sockets: at most `max_sockets` of a path, `max_sockets_per_token` of one token. At most `max_refused_sockets`
    besides are being told by a close code that they are refused; more are by an HTTP status. Each has room for
    `socket_queue` events. A client that takes none of them, or for which one write takes longer than `send_timeout_s`,
    is cut. Each `access_again_s` its token is looked at again: a revoked one ends it. `socket_buffer_bytes` bounds the
    kernel's part.
    """

    gateway: str
    version: str
    web_root: Path | None = None
    tile_url: str | None = None
    tile_file: Path | None = None
    tile_attribution: str = ""
    allowed_hosts: tuple[str, ...] = ()
    allowed_origins: tuple[str, ...] = ()
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

"""`waydrop health` finds the service as it was configured, and nothing else."""

from __future__ import annotations

import ssl
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from socket import AF_INET, AF_INET6

import pytest

from tests.support.certificates import write_certificate
from tests.support.commands import Capture, status_of
from tests.support.paths import ROOT


@pytest.fixture(autouse=True)
def _no_settings_of_this_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("HOST", "PORT", "TLS_CERT", "TLS_KEY"):
        monkeypatch.delenv(f"WAYDROP_{name}", raising=False)


@contextmanager
def answering(
    host: str = "127.0.0.1", status: int = 200, certificate: tuple[Path, Path] | None = None
) -> Iterator[int]:
    """A service whose /readyz has this status; its port."""

    class Ready(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(status if self.path == "/readyz" else 404)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    class Server(HTTPServer):
        address_family = AF_INET6 if ":" in host else AF_INET

    with Server((host, 0), Ready) as server:
        if certificate is not None:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(*certificate)
            server.socket = context.wrap_socket(server.socket, server_side=True)
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield int(server.server_address[1])
        finally:
            server.shutdown()
            thread.join()


@pytest.mark.parametrize(
    ("listens", "configured"),
    [
        ("127.0.0.1", "127.0.0.1"),
        ("127.0.0.1", "0.0.0.0"),
        ("127.0.0.2", "127.0.0.2"),
        ("::1", "::"),
        ("127.0.0.1", ""),
    ],
)
def test_a_ready_service_is_found_at_its_address_and_past_any_proxy(
    monkeypatch: pytest.MonkeyPatch, listens: str, configured: str
) -> None:
    monkeypatch.setenv("http_proxy", "http://127.0.0.1:9")
    monkeypatch.setenv("WAYDROP_TLS_CERT", "")
    monkeypatch.setenv("WAYDROP_HOST", configured)
    with answering(listens) as port:
        monkeypatch.setenv("WAYDROP_PORT", str(port))
        assert status_of(monkeypatch, "health") == 0
        monkeypatch.setenv("WAYDROP_PORT", "")
        assert status_of(monkeypatch, "health", "--port", str(port)) == 0


def test_it_speaks_tls_as_the_service_does(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    certificate, key = write_certificate(tmp_path)
    monkeypatch.setenv("WAYDROP_TLS_CERT", str(certificate))
    monkeypatch.setenv("WAYDROP_TLS_KEY", str(key))
    with answering(certificate=(certificate, key)) as port:
        assert status_of(monkeypatch, "health", "--port", str(port)) == 0


def test_one_that_is_not_ready_or_not_there_ends_with_another_status(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    with answering(status=503) as port:
        assert status_of(monkeypatch, "health", "--port", str(port)) == 4
    assert "/readyz answers 503" in capsys.readouterr().err
    assert status_of(monkeypatch, "health", "--port", str(port)) == 3
    assert f"port {port} of 127.0.0.1" in capsys.readouterr().err


def test_a_port_that_is_none_is_refused_as_a_setting(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    for port in ("tcp://10.0.0.1:8080", "70000"):
        monkeypatch.setenv("WAYDROP_PORT", port)
        assert status_of(monkeypatch, "health") == 2
        assert "--port" in capsys.readouterr().err


def test_no_other_settings_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """It runs every few seconds beside a flight: app.config would take twice its CPU time."""
    with answering() as port:
        monkeypatch.setenv("WAYDROP_PORT", str(port))
        check = (
            "import sys; from app.cli.main import app; app(['health'], standalone_mode=False); "
            "assert not {'app.config', 'aiohttp', 'asyncio'} & set(sys.modules)"
        )
        subprocess.run((sys.executable, "-c", check), cwd=ROOT, check=True)

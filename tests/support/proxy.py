"""nginx in front of a service, as docs/nginx.conf sets it up, on ports of its own."""

from __future__ import annotations

import os
import re
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.support.certificates import write_certificate
from tests.support.paths import ROOT
from tests.support.service_process import connects, free_tcp_port

NGINX = Path(os.environ.get("WAYDROP_NGINX", "/usr/sbin/nginx"))
START_S = 20.0

MAIN = """
daemon off;
pid {folder}/nginx.pid;
error_log stderr warn;
{user}
events {{ worker_connections 256; }}
http {{
    access_log off;
    client_body_temp_path {folder}/body;
    proxy_temp_path {folder}/proxy;
    fastcgi_temp_path {folder}/fastcgi;
    uwsgi_temp_path {folder}/uwsgi;
    scgi_temp_path {folder}/scgi;
    include {folder}/waydrop.conf;
}}
"""


@dataclass(frozen=True)
class Proxy:
    """Its addresses, and the certificate that it shows."""

    url: str
    plain_url: str
    certificate: Path


@contextmanager
def nginx_before(service_port: int, folder: Path) -> Iterator[Proxy]:
    """nginx with the sample: only ports and files differ, and the number of times that each is replaced is checked."""
    assert NGINX.exists(), "scripts/need-nginx.sh installs nginx"
    certificate, key = write_certificate(folder)
    port, plain_port = free_tcp_port(), free_tcp_port()
    sample = (ROOT / "docs" / "nginx.conf").read_text(encoding="utf-8")
    for old, new in (
        ("server 127.0.0.1:8080;", f"server 127.0.0.1:{service_port};"),
        ("listen 80;", f"listen 127.0.0.1:{plain_port};"),
        ("listen 443 ssl;", f"listen 127.0.0.1:{port} ssl;"),
        ("/etc/ssl/waydrop.crt", str(certificate)),
        ("/etc/ssl/waydrop.key", str(key)),
    ):
        sample, count = re.subn(re.escape(old), new, sample)
        assert count == 1, f"docs/nginx.conf has {old!r} {count} times"
    (folder / "waydrop.conf").write_text(sample, encoding="utf-8")
    user = "user root;" if os.geteuid() == 0 else ""
    (folder / "nginx.conf").write_text(MAIN.format(folder=folder, user=user), encoding="utf-8")
    log = folder / "nginx.log"
    with log.open("wb") as out:
        process = subprocess.Popen([NGINX, "-p", folder, "-c", folder / "nginx.conf"], stdout=out, stderr=out)
    try:
        deadline_s = time.monotonic() + START_S
        while not connects(port):
            assert process.poll() is None, log.read_text()
            assert time.monotonic() < deadline_s, log.read_text()
            time.sleep(0.02)
        yield Proxy(f"https://127.0.0.1:{port}", f"http://127.0.0.1:{plain_port}", certificate)
    finally:
        process.terminate()
        process.wait(10)

"""HTTP and websockets: the only package that runs an aiohttp server."""

from app.api.application import build_app
from app.api.services import ApiServices
from app.api.settings import ApiSettings

__all__ = ["ApiServices", "ApiSettings", "build_app"]

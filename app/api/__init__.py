"""The HTTP and websocket side: the only place that serves aiohttp."""

from app.api.application import build_app
from app.api.services import ApiServices
from app.api.settings import ApiSettings

__all__ = ["ApiServices", "ApiSettings", "build_app"]

"""REST under /api/v1: robots and recordings in, identifications and their exports out."""

from service.api.app import create_app
from service.api.server import serve
from service.api.settings import Settings, default_data_folder

__all__ = ["Settings", "create_app", "default_data_folder", "serve"]

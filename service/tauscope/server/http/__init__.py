"""REST under /api/v1: robots and recordings in, identifications and their exports out."""

from tauscope.server.http.app import create_app, serve
from tauscope.server.http.settings import Settings, default_data_folder

__all__ = ["Settings", "create_app", "default_data_folder", "serve"]

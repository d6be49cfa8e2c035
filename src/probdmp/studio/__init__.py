"""The web app: teach movements with a pen, execute them, disturb them, see what is noticed; every number is the library's."""

from probdmp.studio.server import StudioOptions, serve

__all__ = ["StudioOptions", "serve"]

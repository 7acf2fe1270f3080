"""From one RGB-D recording to an articulated scene. Start reading at pipeline.py."""

__version__ = "0.1.0"

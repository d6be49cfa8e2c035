"""How much a page may ask of the server."""

__all__ = [
    "CANVAS",
    "DT",
    "FRAME_RATE",
    "IMPORTED",
    "JOB_SECONDS",
    "LARGEST_MESSAGE",
    "LARGEST_TRANSPORTED",
    "LARGEST_UPLOAD",
    "LONGEST_NAME",
    "LONGEST_STROKE",
    "MOST_LABELS",
    "MOST_POINTS",
    "MOST_REQUESTS",
    "MOST_SAMPLES",
    "MOST_SESSIONS",
    "MOST_SOCKETS",
    "MOST_STROKES",
    "MOST_VIOLATIONS",
    "SESSION_SECONDS",
    "SIMULATED",
]

CANVAS = (100.0, 75.0)
"""Width and height, units."""
DT = 0.01
"""Seconds between samples of strokes, and between control ticks."""
FRAME_RATE = 60.0
"""Frames per second of playing and tracing."""

LARGEST_MESSAGE = 256 * 1024
"""Bytes of one message of the websocket that are looked at."""
LARGEST_TRANSPORTED = 2 * LARGEST_MESSAGE
"""Bytes beyond which a message is not even received, and ends the connection."""
MOST_VIOLATIONS = 3
"""Messages too large that end the connection."""
LARGEST_UPLOAD = 64 * 1024 * 1024
"""Bytes."""
MOST_SOCKETS = 32
MOST_REQUESTS = 256
"""Connections of all kinds that are answered at a time."""
MOST_SESSIONS = 128
"""Beyond, those that were left longest ago are forgotten."""
SESSION_SECONDS = 30 * 60.0
"""For which a session is kept without a socket."""

MOST_POINTS = 20_000
"""Of a stroke, as it was drawn."""
LONGEST_STROKE = 60.0
"""Seconds."""
MOST_STROKES = 200
"""Of a label."""
MOST_LABELS = 50
IMPORTED = "imported"
"""Stands for executions from files, where a label is asked for."""
LONGEST_NAME = 60
"""Characters."""
MOST_SAMPLES = 1_000_000
"""Of all strokes and imported recordings of a session together."""
JOB_SECONDS = 10.0
"""For which learning, calibrating or reading a file may go on."""
SIMULATED = 20
"""Executions drawn from a movement that nobody has executed so yet, to say what is normal for it."""

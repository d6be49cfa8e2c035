"""What the libraries that read and write robots' recordings need: to be there, and to have their errors understood."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec

from probdmp.errors import DataFileError, MissingExtraError, ProbDMPError

__all__ = ["require_ros", "undamaged"]

RECOVER = "Copy it again; a recording that was not closed is completed by `mcap recover` or `ros2 bag reindex`."


def require_ros() -> None:
    """Refuse, with the command to type, where rosbags or mcap is not installed."""
    for name in ("rosbags", "mcap"):
        if find_spec(name) is None:
            raise MissingExtraError(f"{name} for recordings of robots", "none installed", "Type: pip install 'probdmp[ros]'")


@contextmanager
def undamaged(name: str) -> Iterator[None]:
    """Say of any error within that the file is damaged: hostile ones make these libraries raise dozens of kinds.

    Raises
    ------
    DataFileError
        In place of whatever is raised, but for errors of probdmp.
    """
    try:
        yield
    except ProbDMPError:
        raise
    except Exception as error:
        reason = f"{type(error).__name__}: {error!s:.200}" if str(error) else type(error).__name__
        raise DataFileError(f"an undamaged recording in {name}", reason, RECOVER) from error

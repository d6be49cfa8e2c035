"""The database of a ROS 2 recording: tables of what was recorded, none that are made up while they are read."""

import os
import re
import sqlite3
from contextlib import closing
from pathlib import Path

from probdmp.errors import DataFileError

__all__ = ["check_database"]

PLAIN = ("table", "index")


def check_database(path: Path) -> None:
    """Refuse a database with views, virtual tables or computed columns: a query of it could go on for ever.

    Raises
    ------
    DataFileError
        If it has any.
    sqlite3.Error
        If it is no database.
    """
    with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True)) as database:
        parts = database.execute("SELECT type, name, coalesce(sql, '') FROM sqlite_master LIMIT 1000").fetchall()
    for kind, name, sql in parts:
        if kind not in PLAIN or re.match(r"\s*create\s+virtual", sql, re.I) or re.search(r"\bas\s*\(", sql, re.I):
            got = f"a {kind} {name!r:.50} that is computed"
            raise DataFileError(f"tables alone in {os.fspath(path)}", got, "Recorders write none: do not trust the file.")

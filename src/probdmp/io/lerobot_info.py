"""What `meta/info.json` of a LeRobot dataset says, v2.1 or v3.0, and where its files are: nowhere but in its folder."""

import os
import re
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from string import Formatter
from typing import Any, NamedTuple

from probdmp.checks import SECONDS
from probdmp.errors import DataFileError
from probdmp.io.json_document import read_json
from probdmp.io.recordings import MOST_COLUMNS, listing

__all__ = ["INFO", "LeRobotInfo", "inside", "read_info"]

INFO = "meta/info.json"
VERSIONS = {"v2.1": {"episode_chunk", "episode_index"}, "v3.0": {"chunk_index", "file_index"}}
"""By version: the numbers that the paths of its files are made of."""
NUMBERS = re.compile(r"float(16|32|64)|u?int(8|16|32|64)")
BOOKKEEPING = ("timestamp", "frame_index", "episode_index", "index", "task_index")
"""Features that say which frame a row is, not what was measured."""


class LeRobotInfo(NamedTuple):
    """The checked content of the file."""

    root: Path
    version: str
    fps: float
    """Frames per second."""
    chunks_size: int
    """Episodes in a folder, v2.1."""
    data_path: str
    """Template of the paths of data files."""
    features: Mapping[str, tuple[str, ...]]
    """By name, of those that are vectors of numbers: the names of these."""

    def data_file(self, **numbers: int) -> Path:
        """The data file with such numbers.

        Raises
        ------
        DataFileError
            If it would be outside of the folder.
        """
        return inside(self.root, self.data_path.format(**numbers))


def read_info(root: Path) -> LeRobotInfo:
    """What a dataset is.

    Raises
    ------
    DataFileError
        If the file is damaged, or of a version or with files that are not known.
    """
    path = inside(root, INFO)
    info = read_json(path)
    if not isinstance(info, dict):
        raise DataFileError(f"an object in {path}", f"{info!r:.60}", 'It begins {"codebase_version": "v3.0", …}.')
    version, fps = info.get("codebase_version"), info.get("fps")
    if version not in VERSIONS:
        hint = "LeRobot itself converts older datasets; newer ones may need a newer probdmp."
        raise DataFileError(f"a LeRobot dataset of version {' or '.join(VERSIONS)} in {root}", f"{version!r:.60}", hint)
    if isinstance(fps, bool) or not isinstance(fps, int | float) or not 1 / SECONDS[1] <= fps <= 1 / SECONDS[0]:
        raise DataFileError(f"fps in {path} as a number, frames per second", f"{fps!r:.60}")
    size = info.get("chunks_size", 1000)
    if isinstance(size, bool) or not isinstance(size, int) or size < 1:
        raise DataFileError(f"chunks_size in {path} as a whole number from 1", f"{size!r:.60}")
    template = _checked_template(info.get("data_path"), version, path)
    return LeRobotInfo(root, version, float(fps), size, template, _features(info.get("features"), path))


def inside(root: Path, relative: str) -> Path:
    """A file in a folder.

    Raises
    ------
    DataFileError
        If the path, or where its links lead, is outside of the folder.
    """
    pure = PurePosixPath(relative)
    path = root / pure
    outside = pure.is_absolute() or ".." in pure.parts or "\0" in relative
    if outside or not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(root)):
        hint = "Links that lead elsewhere are not followed: copy the dataset with its files, cp -rL."
        raise DataFileError(f"files within {root}", f"{relative!r:.100}", hint)
    return path


def _checked_template(template: Any, version: str, path: Path) -> str:
    known = VERSIONS[version]
    expected = f"data_path in {path} as the path of a .parquet file with {' and '.join(map(repr, sorted(known)))}"
    if not isinstance(template, str) or not template.endswith(".parquet"):
        raise DataFileError(expected, f"{template!r:.100}", "Data in other formats than Parquet are not read.")
    try:
        parts = list(Formatter().parse(template))
    except ValueError as error:
        raise DataFileError(expected, f"{template!r:.100} ({error})") from error
    for _, field, form, conversion in parts:
        if field is not None and (field not in known or conversion or not re.fullmatch(r"(0?\d{1,2}d?)?", form or "")):
            raise DataFileError(expected, f"{template!r:.100}")
    return template


def _features(features: Any, path: Path) -> dict[str, tuple[str, ...]]:
    if not isinstance(features, dict):
        raise DataFileError(f"features in {path} by name", f"{features!r:.60}")
    found = {}
    for name, feature in features.items():
        if not isinstance(feature, dict) or not NUMBERS.fullmatch(str(feature.get("dtype"))) or name in BOOKKEEPING:
            continue
        shape = feature.get("shape")
        if not isinstance(shape, list) or len(shape) != 1 or not isinstance(shape[0], int) or not 1 <= shape[0] <= MOST_COLUMNS:
            continue
        found[name] = _names(feature.get("names"), shape[0], name)
    if not found:
        raise DataFileError(f"features of numbers in {path}", listing(map(repr, features), 10) or "none")
    return found


def _names(names: Any, count: int, feature: str) -> tuple[str, ...]:
    """One name for each number: of a list, or of a list within an object; numbers where there are none."""
    if isinstance(names, dict):
        lists = [value for value in names.values() if isinstance(value, list)]
        names = lists[0] if len(lists) == 1 else list(names)
    if not isinstance(names, list) or len(names) != count or not all(isinstance(name, str) and name for name in names):
        return tuple(f"{feature}_{i}" for i in range(count)) if count > 1 else (feature,)
    return tuple(name if names.count(name) == 1 else f"{name}_{i}" for i, name in enumerate(names))

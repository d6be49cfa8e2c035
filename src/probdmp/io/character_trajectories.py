"""The Character Trajectories of the UCI Machine Learning Repository, as they are published: `mixoutALL_shifted.mat`.

    mixout              1 × N cell of (3, T) arrays: velocities of the pen, x and y, and the rate of its force
    consts.charlabels   1 × N: which letter each is, from 1
    consts.key          cell of letters
    consts.dt           seconds

Its authors differentiated and smoothed what the tablet measured, in units of their own, and put zeros before and after to align
them (B. H. Williams, M. Toussaint, A. J. Storkey, 2006). Here zeros are cut and sums taken: position after each sample, in
units of the file, from zero; and the force of the pen, from what it was in the beginning.
"""

from collections.abc import Mapping

import numpy as np

from probdmp.checks import FloatArray, check_seconds
from probdmp.errors import DataFileError
from probdmp.io.mat_file import Value
from probdmp.io.timed_recordings import Table

__all__ = ["NAMES", "are_characters", "character_tables"]

NAMES = ("x", "y", "pen_force")


def are_characters(variables: Mapping[str, Value]) -> bool:
    """Whether a MATLAB file is that one."""
    consts = variables.get("consts")
    return "mixout" in variables and isinstance(consts, dict) and {"charlabels", "key", "dt"} <= consts.keys()


def character_tables(variables: Mapping[str, Value], name: str) -> list[Table]:
    """Every letter that was written.

    Raises
    ------
    DataFileError
        If what belongs together does not fit.
    """
    mixout, consts = variables["mixout"], variables["consts"]
    mixout = mixout if isinstance(mixout, list) else [mixout]
    key = consts["key"] if isinstance(consts["key"], list) else [consts["key"]]
    which, dt = np.ravel(consts["charlabels"]), np.ravel(consts["dt"])
    numbers = which.dtype.kind == "f" and np.isin(which, np.arange(1, len(key) + 1)).all()
    if len(which) != len(mixout) or not numbers or not all(isinstance(letter, str) for letter in key):
        got = f"{len(which)} labels for {len(mixout)} of them, and {len(key)} letters"
        raise DataFileError(f"consts.charlabels to number the letters in consts.key for each of mixout in {name}", got)
    if dt.dtype.kind != "f" or len(dt) != 1:
        raise DataFileError(f"consts.dt as one number, seconds, in {name}", f"{consts['dt']!r:.50}")
    step = check_seconds(float(dt[0]), f"consts.dt in {name}")
    tables = []
    for i, (velocities, number) in enumerate(zip(mixout, which.astype(int).tolist(), strict=True)):
        signals = _integrated(velocities, f"mixout{{{i + 1}}} in {name}")
        clock = step * np.arange(len(signals), dtype=np.float64)
        tables.append(Table(dict(zip(NAMES, signals.T, strict=True)), clock, key[number - 1], f"in mixout{{{i + 1}}}"))
    return tables


def _integrated(velocities: Value, place: str) -> FloatArray:
    """(T, 3) array of sums, without the zeros before and after."""
    if not isinstance(velocities, np.ndarray) or velocities.ndim != 2 or len(velocities) != len(NAMES):
        raise DataFileError(f"3 rows of numbers, x, y and pen force, as {place}", f"{np.shape(velocities)}")
    moving = np.flatnonzero((velocities != 0).any(axis=0))
    if not len(moving):
        raise DataFileError(f"a movement as {place}", "zeros alone")
    return np.cumsum(velocities[:, moving[0] : moving[-1] + 1].T, axis=0)

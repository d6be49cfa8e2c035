"""Trajectories as arrays for JSON and `.npz`, and as a short table."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from probdmp.cli.exit_codes import usage
from probdmp.cli.output import print_line, print_table

if TYPE_CHECKING:
    from probdmp.checks import FloatArray
    from probdmp.execution import GaussianTrajectory

__all__ = ["save_arrays", "trajectory_arrays", "trajectory_table", "with_unit"]

ROWS = 12
DOFS_PER_TABLE = 4
"""As many as 80 columns hold."""
ARRAYS = (
    *("times", "positions", "velocities", "accelerations", "position_stds", "velocity_stds", "acceleration_stds"),
    *("log_likelihoods", "contributions", "innovations", "innovation_variances"),
)


def trajectory_arrays(trajectory: "GaussianTrajectory") -> dict[str, Any]:
    """Names, units and every array of a trajectory: times (T,), the others (T, D); the last four of a tracked one only."""
    arrays = {name: getattr(trajectory, name) for name in ARRAYS if hasattr(trajectory, name)}
    return {"names": list(trajectory.names), "units": trajectory.units, **arrays}


def save_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write an `.npz` file, atomically."""
    import numpy as np

    from probdmp.io import write_atomically

    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    with usage():
        write_atomically(path, buffer.getvalue())


def trajectory_table(trajectory: "GaussianTrajectory") -> None:
    """Print a few rows, evenly chosen: positions with their 95 % bands and, if tracked, log-likelihoods."""
    import numpy as np

    from probdmp.execution.trajectory import HALF_BAND

    n_steps, names = len(trajectory.times), trajectory.names
    rows = np.unique(np.linspace(0, n_steps - 1, min(ROWS, n_steps)).round().astype(int))
    positions, bands = trajectory.positions[rows], HALF_BAND * trajectory.position_stds[rows]
    decimals = [_decimals(band) for band in bands.T]
    log_likelihoods = getattr(trajectory, "log_likelihoods", None)
    extra = [] if log_likelihoods is None else ["log-likelihood [nats]"]
    for first in range(0, len(names), DOFS_PER_TABLE):
        shown = range(first, min(first + DOFS_PER_TABLE, len(names)))
        columns = ["time [s]", *(with_unit(names[d], trajectory.units) for d in shown), *extra]
        print_table(
            columns,
            [
                [
                    f"{trajectory.times[t]:.3f}",
                    *(f"{positions[i, d]:.{decimals[d]}f} ± {bands[i, d]:.{decimals[d]}f}" for d in shown),
                    *([] if log_likelihoods is None else [f"{log_likelihoods[t]:.2f}"]),
                ]
                for i, t in enumerate(rows)
            ],
        )
    print_line(f"{len(rows)} of {n_steps} times; positions ± {HALF_BAND} standard deviations (95 %).", style="dim")


def _decimals(bands: "FloatArray") -> int:
    """Decimal places that show two digits of a typical uncertainty."""
    import numpy as np

    typical = np.median(bands[bands > 0]) if np.any(bands > 0) else 1e-3
    return int(np.clip(1 - np.floor(np.log10(typical)), 0, 9))


def with_unit(name: str, units: str) -> str:
    """A heading such as `x [mm]`."""
    return f"{name} [{units}]" if units else name

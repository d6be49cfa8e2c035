"""Trajectories as arrays for JSON and `.npz`, and as a short table."""

import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from probdmp.cli.exit_codes import usage
from probdmp.cli.output import print_line, print_table

if TYPE_CHECKING:
    from probdmp.checks import FloatArray
    from probdmp.execution import GaussianTrajectory, TrackedTrajectory

__all__ = ["save_arrays", "sensor_table", "trajectory_arrays", "trajectory_table", "with_unit"]

ROWS = 12
COLUMNS_PER_TABLE = 4
"""As many as 80 columns hold."""
ARRAYS = (
    *("times", "positions", "velocities", "accelerations", "position_stds", "velocity_stds", "acceleration_stds"),
    *("log_likelihoods", "contributions", "innovations", "innovation_variances"),
)


def trajectory_arrays(trajectory: "GaussianTrajectory") -> dict[str, Any]:
    """Names, units and every array of a trajectory: times (T,), the others (T, D); learned channels by name, (T,) arrays.

    Of a tracked one also what the sensors said: log-likelihoods (T,), arrays (T, O), the names of the outputs, and sensors by
    name.
    """
    from probdmp.execution import TrackedTrajectory

    arrays = {name: getattr(trajectory, name) for name in ARRAYS if hasattr(trajectory, name)}
    channels = {name: {"means": channel.means, "stds": channel.stds} for name, channel in trajectory.channels.items()}
    document = {"names": list(trajectory.names), "units": trajectory.units, **arrays, "channels": channels}
    if isinstance(trajectory, TrackedTrajectory):
        document |= {"outputs": list(trajectory.outputs), "sensors": _sensors(trajectory)}
    return document


def _sensors(tracked: "TrackedTrajectory") -> dict[str, dict[str, Any]]:
    """By name of each sensor: its outputs, test ratios (T,), whether each reading was used or rejected, and how many were."""
    return {
        name: {
            "outputs": list(tracked.outputs[tracked.array.slices[name]]),
            **{key: getattr(track, key) for key in ("test_ratios", "fused", "rejected", "n_fused", "n_rejected", "n_missing")},
        }
        for name, track in tracked.sensors.items()
    }


def save_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write an `.npz` file, atomically; what is nested is named by its path, such as channels/pen_force/means."""
    import numpy as np

    from probdmp.io import write_atomically

    buffer = io.BytesIO()
    np.savez(buffer, **dict(_flat(arrays)))
    with usage():
        write_atomically(path, buffer.getvalue())


def _flat(arrays: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in arrays.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{path}{name}/")
        else:
            yield f"{path}{name}", value


def trajectory_table(trajectory: "GaussianTrajectory") -> None:
    """Print a few rows, evenly chosen: positions and channels with their 95 % bands and, if tracked, log-likelihoods."""
    import numpy as np

    from probdmp.execution.trajectory import HALF_BAND

    n_steps, channels = len(trajectory.times), trajectory.channels
    rows = np.unique(np.linspace(0, n_steps - 1, min(ROWS, n_steps)).round().astype(int))
    names = [*(with_unit(name, trajectory.units) for name in trajectory.names), *channels]
    values = np.column_stack([trajectory.positions, *(channel.means for channel in channels.values())])[rows]
    stds = np.column_stack([trajectory.position_stds, *(channel.stds for channel in channels.values())])[rows]
    bands = HALF_BAND * stds
    decimals = [_decimals(band) for band in bands.T]
    log_likelihoods = getattr(trajectory, "log_likelihoods", None)
    extra = [] if log_likelihoods is None else ["log-likelihood [nats]"]
    for first in range(0, len(names), COLUMNS_PER_TABLE):
        shown = range(first, min(first + COLUMNS_PER_TABLE, len(names)))
        columns = ["time [s]", *(names[d] for d in shown), *extra]
        print_table(
            columns,
            [
                [
                    f"{trajectory.times[t]:.3f}",
                    *(f"{values[i, d]:.{decimals[d]}f} ± {bands[i, d]:.{decimals[d]}f}" for d in shown),
                    *([] if log_likelihoods is None else [f"{log_likelihoods[t]:.2f}"]),
                ]
                for i, t in enumerate(rows)
            ],
        )
    print_line(f"{len(rows)} of {n_steps} times; ± {HALF_BAND} standard deviations (95 %).", style="dim")


def sensor_table(tracked: "TrackedTrajectory") -> None:
    """Print what became of the readings of each sensor; nothing if positions are all that was measured."""
    import numpy as np

    tracks = tracked.sensors
    if tracked.outputs == tracked.names:
        return
    ratios = [np.max(track.test_ratios, initial=-np.inf, where=~np.isnan(track.test_ratios)) for track in tracks.values()]
    print_table(
        ["sensor", "outputs", "used", "rejected", "missing", "largest\ntest ratio"],
        [
            [
                name,
                "\n".join(tracked.outputs[tracked.array.slices[name]]),
                *(str(count) for count in (track.n_fused, track.n_rejected, track.n_missing)),
                f"{ratio:.2f}" if np.isfinite(ratio) else "–",
            ]
            for (name, track), ratio in zip(tracks.items(), ratios, strict=True)
        ],
    )


def _decimals(bands: "FloatArray") -> int:
    """Decimal places that show two digits of a typical uncertainty."""
    import numpy as np

    typical = np.median(bands[bands > 0]) if np.any(bands > 0) else 1e-3
    return int(np.clip(1 - np.floor(np.log10(typical)), 0, 9))


def with_unit(name: str, units: str) -> str:
    """A heading such as `x [mm]`."""
    return f"{name} [{units}]" if units else name

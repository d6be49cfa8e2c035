"""Recorded movement as checked data, the built-in letters, and faults to inject."""

from probdmp.demonstrations.demonstration import Demonstration, Recording, Recordings, as_demonstrations, stack_positions
from probdmp.demonstrations.extent import mean_ranges
from probdmp.demonstrations.faults import FAULTS, hold
from probdmp.demonstrations.letters import LETTERS, WriterVariation, synthetic_letters
from probdmp.demonstrations.resampling import demonstration_from_times, positions_on_phases
from probdmp.demonstrations.smoothing import SmoothPath, noise_stds, smooth_path

__all__ = [
    "FAULTS",
    "LETTERS",
    "Demonstration",
    "Recording",
    "Recordings",
    "SmoothPath",
    "WriterVariation",
    "as_demonstrations",
    "demonstration_from_times",
    "hold",
    "mean_ranges",
    "noise_stds",
    "positions_on_phases",
    "smooth_path",
    "stack_positions",
    "synthetic_letters",
]

"""Recorded movement as checked data, the built-in letters and arm movements, and faults to inject."""

from probdmp.demonstrations.arm_movements import ARM_MOVEMENTS, ArmMovement, ArmVariation, synthetic_arm_movements
from probdmp.demonstrations.demonstration import Demonstration, Recording, Recordings, as_demonstrations, stack_positions
from probdmp.demonstrations.extent import largest_extent, mean_ranges
from probdmp.demonstrations.faults import BENIGN, FAILURE, FAULTS, SENSOR, Fault, fault_named
from probdmp.demonstrations.letters import LETTERS, WriterVariation, WrittenLetter, synthetic_letters, written_letters
from probdmp.demonstrations.movement_faults import hold
from probdmp.demonstrations.perturbation import ONSETS, fault_generator, perturb_executions
from probdmp.demonstrations.resampling import demonstration_from_times, positions_on_phases
from probdmp.demonstrations.sigma_lognormal import Strokes
from probdmp.demonstrations.smoothing import SmoothPath, noise_stds, smooth_path, without_noise

__all__ = [
    "ARM_MOVEMENTS",
    "BENIGN",
    "FAILURE",
    "FAULTS",
    "LETTERS",
    "ONSETS",
    "SENSOR",
    "ArmMovement",
    "ArmVariation",
    "Demonstration",
    "Fault",
    "Recording",
    "Recordings",
    "SmoothPath",
    "Strokes",
    "WriterVariation",
    "WrittenLetter",
    "as_demonstrations",
    "demonstration_from_times",
    "fault_generator",
    "fault_named",
    "hold",
    "largest_extent",
    "mean_ranges",
    "noise_stds",
    "perturb_executions",
    "positions_on_phases",
    "smooth_path",
    "stack_positions",
    "synthetic_arm_movements",
    "synthetic_letters",
    "without_noise",
    "written_letters",
]

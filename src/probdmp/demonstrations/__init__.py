"""Recorded movement as checked data, the built-in letters and arm movements, and faults to inject."""

from typing import TYPE_CHECKING

from probdmp.loading import loaded_when_used

if TYPE_CHECKING:
    from probdmp.demonstrations.arm_movements import ARM_MOVEMENTS, ArmMovement, ArmVariation, synthetic_arm_movements
    from probdmp.demonstrations.contacts import Contact, ContactVariation, synthetic_contacts
    from probdmp.demonstrations.demonstration import (
        Demonstration,
        Recording,
        Recordings,
        as_demonstrations,
        signals_of,
        stack_signals,
    )
    from probdmp.demonstrations.extent import channel_ranges, largest_extent, mean_ranges
    from probdmp.demonstrations.faults import BENIGN, CHANNEL_FAULTS, FAILURE, FAULTS, SENSOR, Fault, fault_named
    from probdmp.demonstrations.letters import LETTERS, WriterVariation, WrittenLetter, synthetic_letters, written_letters
    from probdmp.demonstrations.live_resampling import LiveResampling
    from probdmp.demonstrations.movement_faults import hold
    from probdmp.demonstrations.perturbation import ONSETS, fault_generator, perturb_executions
    from probdmp.demonstrations.placing import Placement, are_within, placement_within
    from probdmp.demonstrations.resampling import channel_from_times, demonstration_from_times, signals_on_phases
    from probdmp.demonstrations.sigma_lognormal import Strokes
    from probdmp.demonstrations.smoothing import SmoothPath, noise_stds, smooth_path, without_noise
    from probdmp.demonstrations.trimming import trim_still_ends

__all__ = [
    "ARM_MOVEMENTS",
    "BENIGN",
    "CHANNEL_FAULTS",
    "FAILURE",
    "FAULTS",
    "LETTERS",
    "ONSETS",
    "SENSOR",
    "ArmMovement",
    "ArmVariation",
    "Contact",
    "ContactVariation",
    "Demonstration",
    "Fault",
    "LiveResampling",
    "Placement",
    "Recording",
    "Recordings",
    "SmoothPath",
    "Strokes",
    "WriterVariation",
    "WrittenLetter",
    "are_within",
    "as_demonstrations",
    "channel_from_times",
    "channel_ranges",
    "demonstration_from_times",
    "fault_generator",
    "fault_named",
    "hold",
    "largest_extent",
    "mean_ranges",
    "noise_stds",
    "perturb_executions",
    "placement_within",
    "signals_of",
    "signals_on_phases",
    "smooth_path",
    "stack_signals",
    "synthetic_arm_movements",
    "synthetic_contacts",
    "synthetic_letters",
    "trim_still_ends",
    "without_noise",
    "written_letters",
]

__getattr__, __dir__ = loaded_when_used(
    __name__,
    {
        "arm_movements": ("ARM_MOVEMENTS", "ArmMovement", "ArmVariation", "synthetic_arm_movements"),
        "contacts": ("Contact", "ContactVariation", "synthetic_contacts"),
        "demonstration": ("Demonstration", "Recording", "Recordings", "as_demonstrations", "signals_of", "stack_signals"),
        "extent": ("channel_ranges", "largest_extent", "mean_ranges"),
        "faults": ("BENIGN", "CHANNEL_FAULTS", "FAILURE", "FAULTS", "SENSOR", "Fault", "fault_named"),
        "letters": ("LETTERS", "WriterVariation", "WrittenLetter", "synthetic_letters", "written_letters"),
        "live_resampling": ("LiveResampling",),
        "movement_faults": ("hold",),
        "perturbation": ("ONSETS", "fault_generator", "perturb_executions"),
        "placing": ("Placement", "are_within", "placement_within"),
        "resampling": ("channel_from_times", "demonstration_from_times", "signals_on_phases"),
        "sigma_lognormal": ("Strokes",),
        "smoothing": ("SmoothPath", "noise_stds", "smooth_path", "without_noise"),
        "trimming": ("trim_still_ends",),
    },
)

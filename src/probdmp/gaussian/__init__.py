"""Linear-Gaussian inference: filter, smoother, sampling. It knows nothing of movement and can be used alone."""

from probdmp.gaussian.augmented import (
    AugmentedUpdate,
    Deviation,
    no_deviation,
    observe_deviation,
    predict_deviation,
    smooth_deviations,
)
from probdmp.gaussian.augmented_steps import (
    AugmentedState,
    AugmentedTick,
    Look,
    Moves,
    augmented_tick,
    no_observations,
    states_now,
)
from probdmp.gaussian.coupling import block_diagonal, couple_systems
from probdmp.gaussian.density import gaussian_log_density, output_shares
from probdmp.gaussian.filtering import AffineObservation, FilteredSequence, filter_sequence, predict, update
from probdmp.gaussian.linearization import Linearization, linearize_extended, linearize_unscented, wrapped
from probdmp.gaussian.model import GaussianSequence, LinearGaussianModel
from probdmp.gaussian.sampling import sample_sequences
from probdmp.gaussian.series import SharedGains, score_series, shared_gains, shifted_paths, smooth_series
from probdmp.gaussian.smoothing import smooth_sequence
from probdmp.gaussian.static import Belief, StaticUpdate, linear_moments, observe, unit_belief

__all__ = [
    "AffineObservation",
    "AugmentedState",
    "AugmentedTick",
    "AugmentedUpdate",
    "Belief",
    "Deviation",
    "FilteredSequence",
    "GaussianSequence",
    "LinearGaussianModel",
    "Linearization",
    "Look",
    "Moves",
    "SharedGains",
    "StaticUpdate",
    "augmented_tick",
    "block_diagonal",
    "couple_systems",
    "filter_sequence",
    "gaussian_log_density",
    "linear_moments",
    "linearize_extended",
    "linearize_unscented",
    "no_deviation",
    "no_observations",
    "observe",
    "observe_deviation",
    "output_shares",
    "predict",
    "predict_deviation",
    "sample_sequences",
    "score_series",
    "shared_gains",
    "shifted_paths",
    "smooth_deviations",
    "smooth_sequence",
    "smooth_series",
    "states_now",
    "unit_belief",
    "update",
    "wrapped",
]

"""Linear-Gaussian inference: filter, smoother, sampling. It knows nothing of movement and can be used alone."""

from probdmp.gaussian.density import gaussian_log_density
from probdmp.gaussian.filtering import FilteredSequence, filter_sequence, predict, update
from probdmp.gaussian.model import GaussianSequence, LinearGaussianModel
from probdmp.gaussian.sampling import sample_sequences
from probdmp.gaussian.smoothing import smooth_sequence
from probdmp.gaussian.static import Belief, StaticUpdate, linear_moments, observe, unit_belief

__all__ = [
    "Belief",
    "FilteredSequence",
    "GaussianSequence",
    "LinearGaussianModel",
    "StaticUpdate",
    "filter_sequence",
    "gaussian_log_density",
    "linear_moments",
    "observe",
    "predict",
    "sample_sequences",
    "smooth_sequence",
    "unit_belief",
    "update",
]

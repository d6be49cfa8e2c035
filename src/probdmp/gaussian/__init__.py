"""Linear-Gaussian inference: filter, smoother, sampling. It knows nothing of movement and can be used alone."""

from probdmp.gaussian.density import gaussian_log_density
from probdmp.gaussian.filtering import FilteredSequence, filter_sequence, predict, update
from probdmp.gaussian.model import GaussianSequence, LinearGaussianModel
from probdmp.gaussian.sampling import sample_sequences
from probdmp.gaussian.smoothing import smooth_sequence

__all__ = [
    "FilteredSequence",
    "GaussianSequence",
    "LinearGaussianModel",
    "filter_sequence",
    "gaussian_log_density",
    "predict",
    "sample_sequences",
    "smooth_sequence",
    "update",
]

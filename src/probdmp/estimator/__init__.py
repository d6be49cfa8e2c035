"""What users touch: estimators in scikit-learn manners, without arithmetic."""

from typing import TYPE_CHECKING

from probdmp.loading import loaded_when_used

if TYPE_CHECKING:
    from probdmp.estimator.flat import FlatDMP, FlatFailureDetector
    from probdmp.estimator.primitive_library import PrimitiveLibrary, load, load_detector
    from probdmp.estimator.probabilistic_dmp import ProbabilisticDMP

__all__ = ["FlatDMP", "FlatFailureDetector", "PrimitiveLibrary", "ProbabilisticDMP", "load", "load_detector"]

__getattr__, __dir__ = loaded_when_used(
    __name__,
    {
        "flat": ("FlatDMP", "FlatFailureDetector"),
        "primitive_library": ("PrimitiveLibrary", "load", "load_detector"),
        "probabilistic_dmp": ("ProbabilisticDMP",),
    },
)

"""What users touch: estimators in scikit-learn manners, without arithmetic."""

from probdmp.estimator.flat import FlatDMP, FlatFailureDetector
from probdmp.estimator.primitive_library import PrimitiveLibrary, load, load_detector
from probdmp.estimator.probabilistic_dmp import ProbabilisticDMP

__all__ = ["FlatDMP", "FlatFailureDetector", "PrimitiveLibrary", "ProbabilisticDMP", "load", "load_detector"]

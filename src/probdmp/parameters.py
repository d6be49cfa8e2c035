"""The manners of scikit-learn's estimators, without scikit-learn: constructor arguments are stored, listed and changed by name.

scikit-learn asks any object for these, whatever its class: `clone`, `Pipeline` and `GridSearchCV` need nothing else. It is
imported only where it has itself asked, in `__sklearn_tags__`.
"""

from inspect import signature
from typing import Any, ClassVar, Self

from probdmp.checks import check_choice

__all__ = ["HasParameters"]


class HasParameters:
    """A class whose constructor does nothing but store its arguments under their own names."""

    _kind_of_estimator: ClassVar[str]
    """As scikit-learn calls it: `"density_estimator"`, `"outlier_detector"`."""
    _takes_tables: ClassVar[bool] = False
    """Whether a data set is a (K, features) array; otherwise a list of demonstrations, or a (K, T, D) array."""

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """The constructor's arguments by name.

        Parameters
        ----------
        deep : whether those of arguments that are estimators themselves come too, as `argument__name`.
        """
        own = {name: getattr(self, name) for name in signature(type(self).__init__).parameters if name != "self"}
        if not deep:
            return own
        parts = {name: value for name, value in own.items() if isinstance(value, HasParameters)}
        return own | {f"{name}__{inner}": v for name, part in parts.items() for inner, v in part.get_params().items()}

    def set_params(self, **parameters: Any) -> Self:
        """Change constructor's arguments by name; `argument__name` changes one of an argument that is an estimator itself."""
        # First whole arguments, then what is inside them.
        for name, value in sorted(parameters.items(), key=lambda item: "__" in item[0]):
            check_choice(name, "the name of a parameter", self.get_params())
            part, _, inner = name.partition("__")
            if inner:
                getattr(self, part).set_params(**{inner: value})
            else:
                setattr(self, name, value)
        return self

    def __repr__(self) -> str:
        arguments = ", ".join(f"{name}={value!r}" for name, value in self.get_params(deep=False).items())
        return f"{type(self).__name__}({arguments})"

    def __sklearn_tags__(self) -> Any:
        """What scikit-learn wants to know of an estimator: what kind it is, and what it takes."""
        from sklearn.utils import InputTags, Tags, TargetTags

        takes = InputTags(two_d_array=self._takes_tables, three_d_array=not self._takes_tables, allow_nan=True)
        return Tags(estimator_type=self._kind_of_estimator, target_tags=TargetTags(required=False), input_tags=takes)

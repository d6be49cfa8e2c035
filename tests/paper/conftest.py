"""Learned movements that the paper's tests share."""

import pytest
from strategies import PAPERS_WEIGHTS

from probdmp import ProbabilisticDMP, synthetic_letters


@pytest.fixture(scope="session")
def letters():
    """Fifteen repetitions of two letters by label: ten to learn from, five more."""
    demonstrations = synthetic_letters(15, letters="as")
    return {letter: [d for d in demonstrations if d.label == letter] for letter in "as"}


@pytest.fixture(scope="session")
def published(letters):
    """The paper's configuration, taught the letter a."""
    return ProbabilisticDMP.as_published().fit(letters["a"][:10])


@pytest.fixture(scope="session")
def default(letters):
    """The paper's model with the scheme and the amplitude that are default, taught the letter a."""
    return ProbabilisticDMP(**PAPERS_WEIGHTS).fit(letters["a"][:10])


@pytest.fixture(params=["published", "default"])
def learned(request):
    """Either."""
    return request.getfixturevalue(request.param)

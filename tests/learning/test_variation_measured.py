"""What docs/variation.md reports still holds, on a part of the recordings."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def variation():
    spec = importlib.util.spec_from_file_location("variation", ROOT / "docs" / "variation.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
@pytest.mark.parametrize("name", ["UCI letters", "Calinon letters", "CLMC reaching"])
def test_bands_hold_what_they_say_and_left_out_executions_are_likely(recordings, variation, name):
    scores = {model: np.mean(s, axis=0) for model, s in variation.measure(name, recordings, slice(None, None, 4)).items()}
    pooled, ours = (variation.Score(*scores[model]) for model in ("pooled, independent", "hierarchical, joint"))
    assert 0.9 <= ours.coverage <= 0.985
    assert pooled.coverage < 0.8
    assert ours.few_points > pooled.few_points + 3
    assert ours.error < pooled.error
    assert ours.all_points > pooled.all_points + 0.5
    assert ours.all_points > variation.Score(*scores["– without deviations"]).all_points + 1
    blend, condition = ours, variation.Score(*scores["– goal conditioned on"])
    attractor = variation.Score(*scores["– goal as attractor"])
    assert blend.few_points > max(condition.few_points, attractor.few_points) - 0.1
    assert blend.error < attractor.error

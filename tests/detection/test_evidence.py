"""Evidence against its definition, computed densely."""

import numpy as np
import pytest
from detection.paths import random_path_model, random_paths, slowed, standstill, with_gaps
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import seeds

from probdmp.demonstrations import fault_named
from probdmp.detection.evidence import Pace, Standstill
from probdmp.detection.windows import gather

KINDS = {Standstill: standstill, Pace: slowed}


def judged(kind, model, places, paths, means):
    offsets = np.concatenate([-kind.before, kind.ahead])
    return kind(model).judge(places, gather(paths, places, offsets), means)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=10)
@given(seeds, st.booleans())
def test_evidence_is_a_log_ratio_of_densities(kind, seed, gaps):
    """Multivariate t, mixed over shifts of tempo; what was not seen before is integrated out."""
    rng = np.random.default_rng(seed)
    model = random_path_model(rng, int(rng.integers(1, 3)))
    paths = random_paths(model, rng, 1, 170)
    places = np.array([0, 9, 50, 89])
    if gaps:
        before = with_gaps(paths, rng, 0.1)
        for place in places:  # the place itself and what follows are seen
            before[:, [place, *(place + kind.ahead)]] = paths[:, [place, *(place + kind.ahead)]]
        paths = before
    means = model.means_for(rng.standard_normal((1, model.means.shape[1])))
    evidence = judged(kind, model, places, paths, means)
    for t, place in enumerate(places):
        for n_ahead in (1, 4, len(kind.ahead)):
            expected = KINDS[kind](model, paths[0], int(place), n_ahead, means[0])
            assert evidence[0, t, n_ahead - 1] == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_what_is_not_seen_is_no_evidence_for_rest_but_what_came_before_it_still_is():
    rng = np.random.default_rng(1)
    model = random_path_model(rng, 2)
    paths, place = random_paths(model, rng, 1, 100), np.array([40])
    whole = judged(Standstill, model, place, paths, model.means[None])[0, 0]
    paths[:, 40 + Standstill.ahead[5], 0] = np.nan
    lost = judged(Standstill, model, place, paths, model.means[None])[0, 0]
    np.testing.assert_allclose(lost[:5], whole[:5], rtol=1e-9)
    assert np.isnan(lost[5:]).all()


@pytest.mark.parametrize(("kind", "fault"), [(Standstill, "hold"), (Pace, "slow")])
def test_what_has_happened_is_likelier_than_that_nothing_has(kind, fault):
    rng = np.random.default_rng(2)
    model, place = random_path_model(rng, 2), np.array([40])
    going = random_paths(model, rng, 20, 101)
    faulty = np.stack([fault_named(fault)(path, 41, rng, [])[:101] for path in going])
    means = np.repeat(model.means[None], 20, axis=0)
    happened, gone_on = (judged(kind, model, place, paths, means)[:, 0, -1] for paths in (faulty, going))
    assert np.all(happened > gone_on)
    assert np.mean(happened > 0) >= 0.9
    assert np.mean(gone_on < 0) >= 0.9

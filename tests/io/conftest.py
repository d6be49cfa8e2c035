"""Values to write: random primitives, and a folder that lasts for all examples of a property."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from probdmp.dmp import ChannelVariation, Configuration, Primitive, Variation
from probdmp.io import ModelContents

MakePrimitive = Callable[..., Primitive]

NOISES = ("forcing_precisions", "observation_variances")


@pytest.fixture(scope="session")
def make_primitive() -> MakePrimitive:
    """`make_primitive(rng, n_dof, n_basis, n_channels)`: numbers over many magnitudes, all allowed; with channels, joint."""

    def covariances(rng, *shape):
        factors = rng.standard_normal((*shape, shape[-1]))
        products = factors @ factors.mT
        return (products + products.mT) / 2

    def varying(rng, n_dof, n_basis, n_channels):
        d, f = n_dof * (n_basis + 2), n_channels * (n_basis + 3)
        whole = covariances(rng, d + f) * 10.0 ** rng.uniform(-90, 90)
        channels = ChannelVariation(
            names=['ünit/"[N]', "", *map(str, range(n_channels))][:n_channels],
            means=rng.standard_normal((n_channels, n_basis + 3)) * 10.0 ** rng.integers(-90, 90, (n_channels, n_basis + 3)),
            covariance=whole[d:, d:],
            cross_covariance=whole[d:, :d],
            **{name: 10.0 ** rng.uniform(-90, 90, n_channels) for name in (*NOISES, "ranges", "residual_variances")},
        )
        means = rng.standard_normal((n_dof, n_basis + 2))
        return {
            "configuration": Configuration(n_basis, weight_uncertainty="joint", goal_handling="attractor", coupling="auto"),
            "variation": Variation(means, whole[:d, :d], rng.uniform(1e-9, 1e9, n_dof)),
            "channels": channels,
        }

    def make(rng, n_dof, n_basis, n_channels=0):
        paper = Configuration(n_basis, float(rng.uniform(1, 50)), "semi_implicit_euler", "paper", "posterior")
        return Primitive(
            **varying(rng, n_dof, n_basis, n_channels) if n_channels else {"configuration": paper},
            weight_means=rng.standard_normal((n_dof, n_basis)) * 10.0 ** rng.integers(-90, 90, (n_dof, n_basis)),
            weight_covariances=covariances(rng, n_dof, n_basis),
            weight_precisions=rng.uniform(1e-9, 1e9, n_dof),
            **{name: 10.0 ** rng.uniform(-90, 90, n_dof) for name in NOISES},
            goal_displacements=rng.standard_normal(n_dof),
            ranges=rng.uniform(1e-3, 1e3, n_dof),
            start=np.full(n_dof, -0.0),
            goal=np.full(n_dof, 5e-324),
            start_velocities=rng.standard_normal(n_dof),
            start_covariances=covariances(rng, n_dof, 2),
            duration=float(rng.uniform(0.1, 10)),
            dt=float(rng.uniform(1e-3, 1e-1)),
            phase_step=float(rng.uniform(1e-3, 1e-1)),
            n_demonstrations=int(rng.integers(1, 100)),
            names=tuple(f"q{i}" for i in range(n_dof)),
            units="rad",
        )

    return make


@pytest.fixture(scope="session")
def small_model(make_primitive: MakePrimitive) -> ModelContents:
    """Three primitives, the last with a channel, and a detector: some 8 kB."""
    rng = np.random.default_rng(0)
    primitives = {"a": make_primitive(rng, 1, 2), "β": make_primitive(rng, 2, 3), "γ": make_primitive(rng, 1, 1, 1)}
    return ModelContents(primitives, {"n_basis": 2, "scaling": "none"}, {"threshold": 4.5, "pool": [1.0, 2.5]}, {"by": "test"})


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that the examples of one property may share."""
    return tmp_path_factory.mktemp("files")

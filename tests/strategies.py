"""Random systems, primitives and sensors for tests of laws."""

from dataclasses import fields, replace

import numpy as np
from hypothesis import strategies as st
from reference import system_at

from probdmp.dmp import (
    ChannelVariation,
    Configuration,
    Primitive,
    Variation,
    linear_gaussian_model,
    step_count,
    task_for,
)
from probdmp.execution import LinearSensor, roll_out
from probdmp.gaussian import LinearGaussianModel, sample_sequences

BATCH_SHAPES = ((), (2,), (2, 3))

PAPERS_WEIGHTS = {"weight_model": "pooled", "weight_uncertainty": "independent"}
"""Arguments of ProbabilisticDMP."""

seeds = st.integers(0, 2**32 - 1)


def random_covariance(rng, shape, size, rank):
    """(*shape, size, size) covariance matrices of at most the given rank, with variances about one."""
    factors = rng.standard_normal((*shape, size, rank)) / np.sqrt(max(rank, 1))
    products = factors @ factors.mT
    return (products + products.mT) / 2


def random_system(rng, n_states, n_inputs, n_sensors, n_steps, batch=(), noise_rank=None, known_start=False):
    """A stable system with variances about one; some of its arrays carry the batch axes, the others are shared.

    noise_rank : of the covariance of the inputs; None: full.
    known_start : whether the first state is known exactly, V0 = 0.
    """

    def axes():
        return batch if rng.integers(2) else ()

    shape = axes()
    a = rng.standard_normal((*shape, n_states, n_states))
    radius = np.abs(np.linalg.eigvals(a)).max(axis=-1)
    a *= (rng.uniform(0.3, 0.98, shape) / radius)[..., None, None]
    shape = axes()
    r = random_covariance(rng, shape, n_sensors, n_sensors) + 0.1 * np.eye(n_sensors)
    return LinearGaussianModel(
        transition=a,
        input_matrix=rng.standard_normal((*axes(), n_states, n_inputs)),
        inputs=rng.standard_normal((n_steps - 1, *batch, n_inputs)),
        input_covariances=random_covariance(
            rng, (n_steps - 1, *batch), n_inputs, n_inputs if noise_rank is None else noise_rank
        ),
        observation_matrix=rng.standard_normal((*axes(), n_sensors, n_states)),
        observation_covariance=r,
        initial_mean=rng.standard_normal((*axes(), n_states)),
        initial_covariance=random_covariance(rng, axes(), n_states, 0 if known_start else n_states),
    )


@st.composite
def systems(draw, batches=BATCH_SHAPES, max_steps=12):
    """Systems of 1 to 4 states, 1 or 2 inputs and 1 to 3 sensors, with full, deficient or no process noise."""
    n_inputs = draw(st.integers(1, 2), label="n_inputs")
    return random_system(
        np.random.default_rng(draw(seeds)),
        draw(st.integers(1, 4), label="n_states"),
        n_inputs,
        draw(st.integers(1, 3), label="n_sensors"),
        draw(st.integers(1, max_steps), label="n_steps"),
        draw(st.sampled_from(batches), label="batch"),
        draw(st.integers(0, n_inputs), label="noise_rank"),
        draw(st.booleans(), label="known_start"),
    )


def draw_observations(model, rng, missing=0.0):
    """(T, *batch, O) observations as the model itself would make them, of which a fraction is NaN."""
    observations = sample_sequences(model, 1, rng)[1][0]
    observations[rng.random(observations.shape) < missing] = np.nan
    return observations


def batch_indices(model):
    """The index of every entry of the batch; a model without batch axes has the one entry ()."""
    return list(np.ndindex(model.batch_shape))


def single(model, index):
    """The model of one entry of the batch."""
    return LinearGaussianModel(*system_at(model, index))


def stacked(models):
    """Models of equal size as one batch (K,)."""
    timed = ("inputs", "input_covariances")
    return LinearGaussianModel(
        **{
            f.name: np.stack([getattr(m, f.name) for m in models], axis=1 if f.name in timed else 0)
            for f in fields(LinearGaussianModel)
        }
    )


def make_primitive(rng, n_dof=2, n_basis=8, **changes):
    """A random primitive with movements about one unit large, between 0.5 and 2 s long.

    changes : fields of `Primitive` or of `Configuration` to be as given.
    """
    choices = {f.name: changes.pop(f.name) for f in fields(Configuration) if f.name in changes}
    configuration = Configuration(n_basis=n_basis, **choices)
    stiffness = configuration.alpha_z**2 / 4  # a forcing term of this size moves the attractor by one unit
    start, displacement = rng.uniform(-1, 1, n_dof), rng.choice([-1, 1], n_dof) * rng.uniform(0.5, 1, n_dof)
    values = {
        "weight_means": rng.standard_normal((n_dof, n_basis)) * stiffness,
        "weight_covariances": random_covariance(rng, (n_dof,), n_basis, n_basis) * (0.1 * stiffness) ** 2,
        "weight_precisions": np.full(n_dof, stiffness**-2),
        "forcing_precisions": rng.uniform(0.5, 2, n_dof) * (0.1 * stiffness) ** -2,
        "observation_variances": 10 ** rng.uniform(-6, -2, n_dof),
        "goal_displacements": displacement,
        "ranges": np.ones(n_dof),
        "start": start,
        "goal": start + displacement,
        "start_velocities": rng.standard_normal(n_dof),
        "start_covariances": random_covariance(rng, (n_dof,), 2, 2) * 0.01,
        "duration": float(rng.uniform(0.5, 2)),
        "dt": 0.01,
        "phase_step": 0.01,
        "n_demonstrations": 10,
        "names": tuple(f"q{i}" for i in range(n_dof)),
        "units": "m",
    }
    return Primitive(configuration=configuration, **(values | changes))


def make_joint_primitive(rng, n_dof=2, n_basis=4, channels=(), rank=None, **changes):
    """A random primitive with joint weights: one Gaussian over the parameters of all signals, each about one unit.

    channels : names of sensor channels.
    rank : of the covariance, full unless given; the lower, the more signals vary together.
    changes : as for `make_primitive`.
    """
    p = make_primitive(rng, n_dof, n_basis, **({"weight_uncertainty": "joint"} | changes))
    stiffness, n_channels = p.configuration.stiffness, len(channels)
    weights = [0.1 * stiffness] * n_basis
    scale = np.concatenate([np.tile([1.0, 0.3, *weights], n_dof), np.tile([0.2, 1.0, 0.3, *weights], n_channels)])
    covariance = random_covariance(rng, (), len(scale), rank or len(scale)) * scale * scale[:, None]
    theta = slice(0, n_dof * (n_basis + 2))
    means = np.column_stack([p.start_velocities, p.goal - p.start, p.weight_means])
    varied = replace(p, variation=Variation(means, covariance[theta, theta], np.full(n_dof, 1e-6)))
    if not channels:
        return varied
    rest, ones = slice(theta.stop, None), np.ones(n_channels)
    unit = np.array([1.0, 1.0, 0.5, *[stiffness] * n_basis])
    of_channels = ChannelVariation(
        names=channels,
        means=rng.standard_normal((n_channels, n_basis + 3)) * unit,
        covariance=covariance[rest, rest],
        cross_covariance=covariance[rest, theta],
        residual_variances=1e-4 * ones,
        observation_variances=1e-3 * ones,
        forcing_precisions=(0.1 * stiffness) ** -2 * ones,
        ranges=ones,
    )
    return replace(varied, channels=of_channels)


def state_scales(primitive, dt):
    """(3 D,) standard deviations of the states of executions at their largest, for sensors that say as much as is known."""
    stds = np.sqrt(np.diagonal(roll_out(primitive, task_for(primitive), dt).covariances, axis1=-2, axis2=-1)).max(axis=0)
    return np.maximum(stds, 1e-3).ravel()


def random_sensors(rng, primitive, dt, n_sensors, coupling=False, gate=None):
    """Linear sensors of 1 to 3 outputs, mixtures of position, velocity and acceleration with a full R, about as noisy as what
    they measure is uncertain or a tenth of that.

    coupling : True: each output sees all degrees of freedom; False: one, which all outputs of its sensor see; "noise": one,
        another one than the next output of the sensor, with which it shares noise.
    """
    scales, sensors = state_scales(primitive, dt), []
    for i in range(n_sensors):
        n_outputs = int(rng.integers(2 if coupling == "noise" else 1, 4))
        matrix = rng.standard_normal((n_outputs, primitive.n_dof, 3)) * (rng.random((n_outputs, primitive.n_dof, 3)) < 0.7)
        matrix[..., 2] += ~matrix.any(axis=-1)
        if coupling is not True:
            owners = np.arange(n_outputs) * (coupling == "noise") + rng.integers(primitive.n_dof)
            matrix *= (np.arange(primitive.n_dof) == owners[:, None] % primitive.n_dof)[..., None]
        matrix = matrix.reshape(n_outputs, -1)
        noise = random_covariance(rng, (), n_outputs, n_outputs) + 0.1 * np.eye(n_outputs)
        sensors.append(LinearSensor(f"s{i}", matrix / scales, noise * 10 ** rng.uniform(-2, 0), gate=gate))
    return sensors


@st.composite
def primitives(draw, **changes):
    """Primitives of 1 to 3 degrees of freedom with all choices of `Configuration`; `changes` as for `make_primitive`."""
    choices = {
        "discretization": draw(st.sampled_from(["exact", "semi_implicit_euler"])),
        "scaling": draw(st.sampled_from(["none", "paper"])),
        "forcing_noise": draw(st.sampled_from(["posterior", "predictive"])),
    }
    rng = np.random.default_rng(draw(seeds))
    return make_primitive(rng, draw(st.integers(1, 3)), draw(st.integers(1, 12)), **(choices | changes))


def dmp_system(rng, n_dof=2, n_steps=40, **changes):
    """The linear-Gaussian system of a random primitive on its own way, from an uncertain start, in `n_steps` states."""
    primitive = make_primitive(rng, n_dof, **changes)
    dt = primitive.duration / (n_steps - 1)
    assert step_count(primitive.duration, dt) == n_steps
    return linear_gaussian_model(primitive, task_for(primitive, np.full(n_dof, np.nan)), dt, n_steps)

"""Each law of noise has the moments, tails and shares that theory gives it, within what the sample size allows."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

import gainful as gf
from gainful.running import GaussianMixture, GaussianNoise, ImpulseBursts, SkewedOutliers, StudentTNoise

STEPS = 20000
SIGMA = jnp.array([0.5, 2.0])
LAWS = {
    "gaussian": GaussianNoise(),
    "mixture": GaussianMixture(),
    "mixture together": GaussianMixture(joint=True),
    "t": StudentTNoise(),
    "t together": StudentTNoise(joint=True),
    "bursts": ImpulseBursts(),
    "bursts together": ImpulseBursts(joint=True),
    "skewed": SkewedOutliers(),
}
FOUR = 4.0
"""Standard errors within which a drawn mean must lie: one law in 16000 does not."""


@pytest.fixture(scope="module")
def drawn():
    """A stretch of every law, in multiples of sigma."""
    out = {}
    for i, (name, law) in enumerate(LAWS.items()):
        found = law.realise(jax.random.key(i), STEPS, SIGMA)
        out[name] = np.asarray(found.values / SIGMA), np.asarray(found.variance / SIGMA**2)
    return out


def near(sample, mean, variance, count=None):
    """Whether the mean of a sample is within four standard errors."""
    return abs(np.mean(sample) - mean) < FOUR * np.sqrt(variance / (np.size(sample) if count is None else count))


@pytest.mark.parametrize("name", LAWS)
def test_known_its_own_variance_each_value_has_a_mean_square_of_one(drawn, name):
    values, variance = drawn[name]
    scaled = (values / np.sqrt(variance)).ravel()
    assert near(scaled**2, 1.0, 2.0)
    if name != "skewed":
        assert near(scaled, 0.0, 1.0)
        assert stats.kstest(scaled, "norm").pvalue > 1e-4


@pytest.mark.parametrize("name", LAWS)
def test_drawing_is_realising_without_the_variances(drawn, name):
    i = list(LAWS).index(name)
    np.testing.assert_array_equal(LAWS[name].draw(jax.random.key(i), STEPS, SIGMA) / SIGMA, drawn[name][0])


@pytest.mark.parametrize("name", ["mixture", "skewed"])
def test_a_tenth_of_outliers_of_ten_sigma_has_a_mean_square_of_10_9(drawn, name):
    np.testing.assert_allclose(LAWS[name].mean_square(SIGMA), 10.9 * SIGMA**2, rtol=1e-12)
    values, variance = drawn[name]
    # E e^4 = 3 (0.9 + 0.1 1e4)
    assert near(values**2, 10.9, 3.0 * (0.9 + 0.1 * 1e4) - 10.9**2)
    assert near(variance > 1.0, 0.1, 0.1 * 0.9)


def test_bursts_take_9_6_percent_of_the_samples_in_pieces_of_five(drawn):
    law = ImpulseBursts()
    share = 1.0 - 0.98**5
    assert float(law.share) == pytest.approx(share, rel=1e-12)
    assert share == pytest.approx(0.096, abs=5e-4)
    np.testing.assert_allclose(law.mean_square(SIGMA), (1.0 + share * (16.7**2 - 1.0)) * SIGMA**2, rtol=1e-12)
    during = drawn["bursts"][1] > 1.0
    # Neighbours within a burst are alike: at least one in nine samples is news.
    assert near(during, share, share * (1.0 - share), during.size / 9)
    for column in during.T:
        edges = np.flatnonzero(np.diff(column.astype(int)))
        lengths = np.diff(edges)[(0 if column[edges[0] + 1] else 1) :: 2]
        assert lengths.min() == 5
        # A burst grows if another starts during its last five samples: by no more than chance allows.
        assert np.mean(lengths == 5) == pytest.approx(0.98**5, abs=FOUR * np.sqrt(0.09 / len(lengths)))


def test_a_burst_may_have_started_before_the_record():
    law = ImpulseBursts(0.2, 3)
    keys = jax.random.split(jax.random.key(0), 4000)
    variance = jax.vmap(lambda key: law.realise(key, 4, jnp.ones(1)).variance[:, 0])(keys)
    for column in np.asarray(variance).T > 1.0:
        share = 1.0 - 0.8**3
        assert near(column, share, share * (1.0 - share))


@pytest.mark.parametrize("dof", [3.0, 5.0])
def test_heavy_tails_are_students(dof):
    values = np.asarray(StudentTNoise(dof).draw(jax.random.key(7), STEPS, jnp.ones(2))).ravel()
    assert stats.kstest(values, stats.t(dof).cdf).pvalue > 1e-4
    assert float(StudentTNoise(dof).mean_square(jnp.ones(1))[0]) == pytest.approx(dof / (dof - 2.0))
    assert np.isinf(float(StudentTNoise(2.0).mean_square(jnp.ones(1))[0]))


def test_one_sided_outliers_point_one_way_and_shift_the_mean(drawn):
    law = SkewedOutliers()
    values, variance = drawn["skewed"]
    assert (values[variance > 1.0] >= 0).all()
    assert (values[variance == 1.0] < 0).any()
    mean = 0.1 * 10.0 * np.sqrt(2.0 / np.pi)
    np.testing.assert_allclose(law.mean(SIGMA), mean * SIGMA, rtol=1e-12)
    assert near(values, mean, 10.9 - mean**2)
    down = SkewedOutliers(ratio=-10.0).realise(jax.random.key(0), 200, jnp.ones(1))
    assert (np.asarray(down.values)[np.asarray(down.variance) > 1.0] <= 0).all()


@pytest.mark.parametrize("name", ["mixture", "t", "bursts"])
def test_channels_are_disturbed_together_or_each_on_its_own(drawn, name):
    own, together = drawn[name][1], drawn[f"{name} together"][1]
    np.testing.assert_allclose(together[:, 0], together[:, 1], rtol=1e-12)
    high = own > np.quantile(own, 0.5) if name == "t" else own > 1.0
    shares = high.mean(axis=0)
    both = shares.prod()
    # Bursts repeat themselves over nine samples at most.
    count = STEPS / (9 if name == "bursts" else 1)
    assert near(high.all(axis=1), both, both * (1.0 - both), count)
    values = drawn[f"{name} together"][0]
    product = values.prod(axis=1) / together[:, 0]
    assert near(product, 0.0, 1.0)  # together, but not correlated


@pytest.mark.parametrize(
    "law",
    [GaussianMixture(0.0), GaussianMixture(0.3, 1.0), ImpulseBursts(0.0), SkewedOutliers(0.0), StudentTNoise(1e14)],
    ids=lambda law: type(law).__name__,
)
def test_in_its_limit_every_law_is_gaussian(law):
    found = law.realise(jax.random.key(1), 500, SIGMA)
    np.testing.assert_allclose(found.variance, np.broadcast_to(SIGMA**2, (500, 2)), rtol=1e-5)
    np.testing.assert_allclose(law.mean_square(SIGMA), SIGMA**2, rtol=1e-9)
    assert stats.kstest(np.asarray(found.values / SIGMA).ravel(), "norm").pvalue > 1e-4


@pytest.mark.parametrize("name", ["gaussian", "mixture", "t", "bursts together", "skewed"])
def test_many_at_once_are_the_same_as_one_after_the_other(name):
    law, keys = LAWS[name], jax.random.split(jax.random.key(2), 3)
    batch = jax.vmap(lambda key: law.draw(key, 50, SIGMA))(keys)
    for each, key in zip(batch, keys, strict=True):
        np.testing.assert_allclose(each, law.draw(key, 50, SIGMA), rtol=1e-12)


def test_shares_may_be_swept_in_one_program():
    shares = jnp.array([0.0, 0.2, 0.4])
    found = jax.jit(
        jax.vmap(lambda eps: GaussianMixture(eps, 10.0).realise(jax.random.key(0), STEPS, jnp.ones(1)).variance)
    )(shares)
    for each, share in zip(np.asarray(found), shares.tolist(), strict=True):
        assert near(each > 1.0, share, share * (1.0 - share) + 1e-12)


# ---------------------------------------------------------------- records of a model


def walking():
    model = gf.linear_model([[1.0]], np.ones((2, 1)), Q=0.04, R=np.diag([1.0, 4.0]), outputs=["a", "b"])
    return model, gf.make_prior(model, [0.0], [1.0])


def test_a_drawn_record_has_the_law_asked_for_and_the_truth_of_the_plain_one():
    model, prior = walking()
    t, key = np.arange(3000.0), jax.random.key(0)
    plain = gf.draw_log(model, prior, t, key=key)
    gross = gf.draw_log(model, prior, t, key=key, measurement=GaussianMixture(0.2, 30.0))
    assert gross.truth["x0"].tolist() == plain.truth["x0"].tolist()
    error = (gross.y - gross.truth["x0"][:, None]) / [1.0, 2.0]
    # Beyond 4 sigma lies what an outlier brings there: 2 Phi(-4/30) of them, and 6e-5 of the rest.
    share = 0.2 * 2.0 * stats.norm.cdf(-4.0 / 30.0) + 0.8 * 2.0 * stats.norm.cdf(-4.0)
    assert near(np.abs(error) > 4.0, share, share * (1.0 - share))


def test_a_drawn_record_may_have_a_plant_that_is_kicked():
    model, prior = walking()
    log = gf.draw_log(model, prior, np.arange(3000.0), key=jax.random.key(1), process=GaussianMixture(0.05, 10.0))
    steps = np.diff(log.truth["x0"]) / 0.2
    mean_square = 0.95 + 0.05 * 100.0
    assert near(steps**2, mean_square, 3.0 * (0.95 + 0.05 * 1e4) - mean_square**2)

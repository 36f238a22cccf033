import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from swarmscope.judging.statistics import (
    bootstrap_mean,
    bootstrap_ratio,
    normal_quantile,
    paired_difference,
    poisson_upper,
    sign_flip_p,
    wilson,
)


@pytest.mark.parametrize("probability", [1e-9, 0.025, 0.5, 0.9, 0.975, 0.999999])
def test_normal_quantile_agrees_with_scipy(probability: float) -> None:
    assert normal_quantile(probability) == pytest.approx(stats.norm.ppf(probability), abs=1e-9)


@pytest.mark.parametrize(("successes", "trials"), [(0, 1), (0, 20), (3, 20), (20, 20), (1799, 1800)])
def test_wilson_agrees_with_scipy(successes: int, trials: int) -> None:
    ours, theirs = (
        wilson(successes, trials),
        stats.binomtest(successes, trials).proportion_ci(method="wilson"),
    )
    np.testing.assert_allclose(ours[1:3], [theirs.low, theirs.high], atol=1e-12)
    assert ours.estimate == successes / trials


@given(st.integers(1, 5000), st.data())
def test_wilson_holds_its_estimate_and_stays_a_share(trials: int, data: st.DataObject) -> None:
    successes = data.draw(st.integers(0, trials))
    interval = wilson(successes, trials)
    assert 0.0 <= interval.low <= interval.estimate <= interval.high <= 1.0
    mirrored = wilson(trials - successes, trials)
    assert mirrored.low == pytest.approx(1.0 - interval.high, abs=1e-12)


def test_nothing_and_nonsense() -> None:
    assert wilson(0, 0).used == 0 and math.isnan(wilson(0, 0).low)
    assert bootstrap_mean([]).used == 0 and math.isnan(bootstrap_mean([]).estimate)
    one = bootstrap_mean([3.0, math.nan])
    assert one.estimate == 3.0 and one.used == 1 and math.isnan(one.low)
    assert math.isnan(paired_difference([math.nan], [1.0]).p_value)
    with pytest.raises(ValueError, match="need 0 <= successes <= trials"):
        wilson(3, 2)
    with pytest.raises(ValueError, match="between 0 and 1"):
        bootstrap_mean([1.0], 1.0)
    with pytest.raises(ValueError, match="as many first as second"):
        paired_difference([1.0], [])


def test_bootstrap_is_deterministic_and_about_the_normal_interval() -> None:
    values = np.random.default_rng(5).normal(2.0, 3.0, 400)
    first, again, other = bootstrap_mean(values), bootstrap_mean(values), bootstrap_mean(values, seed=1)
    assert first == again and first != other
    half, mean = 1.96 * values.std() / 20.0, values.mean()
    np.testing.assert_allclose([first.low, first.high], [mean - half, mean + half], atol=0.06 * half)


def test_bootstrap_covers_as_often_as_it_says() -> None:
    rng = np.random.default_rng(8)
    inside = 0
    for run in range(300):
        interval = bootstrap_mean(rng.normal(0.0, 1.0, 40), seed=run, resamples=500)
        inside += interval.low <= 0.0 <= interval.high
    assert 0.89 <= inside / 300 <= 0.98


def test_sign_flips_worked_by_hand() -> None:
    assert sign_flip_p([1.0, 2.0, 3.0]) == pytest.approx(2 / 8)  # only +++ and --- reach |6|
    assert sign_flip_p([1.0, -1.0]) == 1.0
    assert sign_flip_p([0.0, 0.0]) == 1.0
    assert sign_flip_p([0.1] * 10) == pytest.approx(2 / 1024)


def test_sign_flips_agree_with_scipy_exactly_and_at_random() -> None:
    rng = np.random.default_rng(3)
    for size, tolerance in ((9, 1e-12), (40, 0.02)):
        data = rng.normal(0.3, 1.0, size)
        theirs = stats.permutation_test(
            (data,), np.mean, permutation_type="samples", n_resamples=9999, rng=rng
        )
        assert sign_flip_p(data) == pytest.approx(theirs.pvalue, abs=tolerance)


def test_pairs_see_what_unpaired_data_hide() -> None:
    maps = np.random.default_rng(2).normal(50.0, 20.0, 20)
    gain = np.random.default_rng(4).normal(1.0, 0.5, 20)
    result = paired_difference(maps + gain, maps)
    assert result.estimate == pytest.approx(gain.mean())
    assert result.low > 0.0 and result.p_value < 0.001 and result.used == 20
    swapped = paired_difference(maps, maps + gain)
    assert swapped.estimate == pytest.approx(-result.estimate) and swapped.p_value == result.p_value
    assert paired_difference([1.0, 2.0, math.nan], [1.0, math.nan, 3.0]).used == 1


def test_ratios_of_sums() -> None:
    found = bootstrap_ratio([1.0, 2.0, 3.0], [2.0, 4.0, 6.0])
    assert found == (0.5, 0.5, 0.5, 3)
    wide = bootstrap_ratio([0.0, 3.0, 1.0, math.nan], [1.0, 5.0, 2.0, 9.0])
    assert wide.estimate == 0.5 and wide.used == 3 and 0.0 <= wide.low < 0.5 < wide.high <= 0.6
    assert wide == bootstrap_ratio([0.0, 3.0, 1.0, math.nan], [1.0, 5.0, 2.0, 9.0])
    assert math.isnan(bootstrap_ratio([], []).estimate) and math.isnan(bootstrap_ratio([1.0], [0.0]).estimate)
    one = bootstrap_ratio([1.0], [4.0])
    assert one.estimate == 0.25 and math.isnan(one.low)
    with pytest.raises(ValueError, match="as many"):
        bootstrap_ratio([1.0], [1.0, 2.0])


@pytest.mark.parametrize(("count", "bound"), [(0, 2.9957), (1, 4.7439), (2, 6.2958), (3, 7.7537), (10, 16.9622)])
def test_the_bound_of_a_poisson_mean_is_that_of_the_tables(count: int, bound: float) -> None:
    assert poisson_upper(count) == pytest.approx(bound, abs=1e-4)


@given(st.integers(0, 500), st.floats(0.5, 0.999))
def test_the_bound_of_a_poisson_mean_is_half_a_chi_square_quantile(count: int, confidence: float) -> None:
    theirs = 0.5 * stats.chi2.ppf(confidence, 2 * count + 2)
    assert poisson_upper(count, confidence) == pytest.approx(theirs, rel=1e-9)


def test_nothing_counts_below_zero() -> None:
    with pytest.raises(ValueError, match="at least 0"):
        poisson_upper(-1)

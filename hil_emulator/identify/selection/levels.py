"""Thresholds of the search: significance levels, shares of the chi-square, and their quantiles.

All rules share these numbers. Limits of the computing effort are in the modules that use them.
"""

import math
from statistics import NormalDist

FALSE_ALARM = 1e-3
"""Probability that noise makes any candidate significant in a healthy machine (chosen). Wrong
ordinary parameters are covered by other tests."""

GREATER_PART = 0.5
"""Share of a gain in chi-square, or squared cosine, above which one explanation outweighs all
others together. Its reciprocal, 2, is the ratio from which one gain is far larger than another."""

NEARLY_ALL = 0.75
"""Share of the best candidate's gain from which another candidate is its rival. In 273 rounds of
blind cases the true effect, refitted, had the largest gain in 238, at least 0.80 of the best gain
in 24, 0.72 in one, and less than 0.5 in ten, mostly where a second effect was missing."""

SMALL_PART = 0.1
"""Negligible share. A true law with fewer assumed shape parameters than its rival gained at least
0.998 of the rival's gain in 18 rounds; a wrong law with fewer gained at most 0.80 in five."""

LAW_TOLERANCE = 0.015
"""Residual, as a share of the gain of an effect, that an approximate law may leave; a smaller one
decides nothing. Correct laws left up to 0.0144 in 44 machines, wrong laws at least 0.023."""

NOTICEABLE = 0.01
"""Share of the innovations' variance, beyond chance, below which a term is not reported.

Ripple of friction and supply is significant in every machine: up to 0.8 % in 22 healthy ones, and
more than 1 % in six of ten with three times the usual ripple. For a term with more hat functions
the limit is proportionally higher."""


SIGNIFICANCE = 0.05
"""Significance level of reported intervals and of warnings about implausible parameters."""


def chi2_threshold(alarm: float, candidates: int = 1) -> float:
    """Return the critical value of a chi-square with one degree of freedom, Bonferroni corrected.

    It holds for the gain in chi-square of a candidate without effect, and for its Wald statistic
    if the residuals are serially correlated.

    Args:
        alarm: probability that any of the candidates exceeds the value by chance.
        candidates: number of candidates that are tested.

    """
    return NormalDist().inv_cdf(1.0 - 0.5 * alarm / max(candidates, 1)) ** 2


def needed_delta_chi2(candidates: int) -> float:
    """Return the gain in chi-square that the best of some candidates must exceed to be named."""
    return chi2_threshold(FALSE_ALARM, candidates)


NORMAL_95 = math.sqrt(chi2_threshold(SIGNIFICANCE))
"""Half width of a 95 % interval, in standard deviations."""

DISTINGUISHABLE = chi2_threshold(FALSE_ALARM)
"""Difference in chi-square from which two given explanations are distinguishable."""

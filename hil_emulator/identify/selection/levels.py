"""The numbers by which a search tells much from little, and one thing from another.

Each is used wherever its question is asked: a share that counts as most of something is the same
share for all. What only says how long is computed stands where it is used.
"""

import math
from statistics import NormalDist

FALSE_ALARM = 1e-3
"""Probability that chance alone lets one of all candidates gain enough in a healthy machine: a
level of significance, chosen. Against wrong ordinary parameters there are other tests."""

GREATER_PART = 0.5
"""Of what is explained, or of a squared cosine: who has more of it than all others together does
the work, so that no other value could be meant. Upside down, what is far more: twice as much."""

NEARLY_ALL = 0.75
"""Part of what the best explains that makes another one a rival of it. Of 273 rounds of blind
cases in which the true effect was refitted, it gained the most in 238, 0.80 or more of the best in
24, 0.72 in one, and less than half in ten, where mostly another effect is missing as well."""

SMALL_PART = 0.1
"""What hardly counts beside the rest. Where a true law with fewer assumed shapes contended with one
that has more, it gained 0.998 or more of what that did, in 18 rounds; a wrong law with fewer gained
at most 0.80 of what the true one did, in five."""

LAW_TOLERANCE = 0.015
"""Part of what an effect explains that its law may leave, so that nothing can be told from less: 44
machines with the catalogue's laws lacked up to 0.0144, wrongly named ones from 0.023 on."""

NOTICEABLE = 0.01
"""Share of the innovations' variance, chance set aside, below which nothing is worth a word: ripple
of friction and supply, which every machine has, is there and significant. It makes up to 0.8 % in
22 healthy machines, and more than this in six of ten whose ripple is three times as large. A
term of many hat functions follows it, and needs in proportion more."""


SIGNIFICANCE = 0.05
"""Probability of what is still told without a name: a 95 % interval leaves as much."""


def chi2_threshold(alarm: float, candidates: int = 1) -> float:
    """Return what any of some candidates gains in chi-square with a given probability.

    What one candidate gains by chance is a squared normal variable, and so is its Wald statistic
    where the residuals are serially correlated; of many, each gets its part of the probability
    (Bonferroni).
    """
    return NormalDist().inv_cdf(1.0 - 0.5 * alarm / max(candidates, 1)) ** 2


def needed_delta_chi2(candidates: int) -> float:
    """Return what a name needs, the best of so many candidates: robust statistic, or plain gain."""
    return chi2_threshold(FALSE_ALARM, candidates)


NORMAL_95 = math.sqrt(chi2_threshold(SIGNIFICANCE))
"""Standard deviations to either end of a 95 % interval."""

DISTINGUISHABLE = chi2_threshold(FALSE_ALARM)
"""Difference in chi-square of two given explanations that is hardly chance."""

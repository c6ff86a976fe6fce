# SPDX-License-Identifier: BSD-3-Clause
"""Limits of a share that was counted."""
import math


def incomplete_beta(x, a, b):
    """Regularised, by its continued fraction (Lentz)."""
    if x <= 0 or x >= 1:
        return min(max(x, 0.0), 1.0)
    if x > (a + 1) / (a + b + 2):
        return 1 - incomplete_beta(1 - x, b, a)
    front = math.exp(math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log1p(-x)) / a
    f, c, d = 1.0, 1.0, 0.0
    for i in range(400):
        m = i // 2
        n = 1.0 if i == 0 else m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)) if i % 2 == 0 else \
            -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))
        d = 1 / (1 + n * d or 1e-300)
        c = 1 + n / c or 1e-300
        f *= c * d
        if abs(1 - c * d) < 1e-12:
            break
    return front * (f - 1)


def limits(x, n, level=0.95):
    """Clopper and Pearson, two-sided; x may be a sum of shares: then the limits are those of its pairs at the worst."""
    def quantile(p, a, b):
        low, high = 0.0, 1.0
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if incomplete_beta(middle, a, b) < p else (low, middle)
        return high
    tail = (1 - level) / 2
    return (quantile(tail, x, n - x + 1) if x > 0 else 0.0, quantile(1 - tail, x + 1, n - x) if x < n else 1.0)

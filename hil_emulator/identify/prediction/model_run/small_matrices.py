"""Operations on small vectors and matrices, for which a library call would take longer."""

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Single


def root_of_inverse(s: Array, root: Array) -> None:
    """Compute the lower triangular L with S^-1 = L L^T for a positive definite S; overwrites S."""
    m = len(s)
    # S = U U^T from the last row upwards, with U upper triangular; then L = U^-T
    for j in range(m - 1, -1, -1):
        for k in range(j + 1, m):
            s[j, j] -= s[j, k] ** 2
        s[j, j] = np.sqrt(s[j, j])
        for i in range(j):
            for k in range(j + 1, m):
                s[i, j] -= s[i, k] * s[j, k]
            s[i, j] /= s[j, j]
    for i in range(m):
        for j in range(m):
            root[i, j] = 0.0
        root[i, i] = 1.0 / s[i, i]
        for j in range(i):
            for k in range(j, i):
                root[i, j] -= s[k, i] * root[k, j]
            root[i, j] /= s[i, i]


def copy(values: Array, out: Array) -> None:
    """Copy a vector; compiles faster than a slice assignment, which may raise an exception."""
    for i in range(len(out)):
        out[i] = values[i]


def duplicate(matrix: Array, out: Array | Single) -> None:
    """Copy a matrix."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            out[i, j] = matrix[i, j]


def multiply(a: Array, b: Array, out: Array) -> None:
    """Compute the product a b."""
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            total = 0.0
            for k in range(a.shape[1]):
                total += a[i, k] * b[k, j]
            out[i, j] = total


def divide(a: Array, b: Array) -> None:
    """Replace b by the solution x of a x = b, by Gaussian elimination; overwrites a."""
    n, columns = b.shape
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(n):
                a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
            for j in range(columns):
                b[k, j], b[pivot, j] = b[pivot, j], b[k, j]
        per = 1.0 / a[k, k]
        for i in range(k + 1, n):
            part = a[i, k] * per
            if part != 0.0:
                for j in range(k, n):
                    a[i, j] -= part * a[k, j]
                for j in range(columns):
                    b[i, j] -= part * b[k, j]
    for k in range(n - 1, -1, -1):
        for i in range(k + 1, n):
            for j in range(columns):
                b[k, j] -= a[k, i] * b[i, j]
        per = 1.0 / a[k, k]
        for j in range(columns):
            b[k, j] *= per


def congruence(a: Array, b: Array, work: Array, out: Array) -> None:
    """Compute a b a^T for a symmetric b; `work` is memory of the shape of a."""
    multiply(a, b, work)
    for i in range(a.shape[0]):
        for j in range(i + 1):
            total = 0.0
            for k in range(a.shape[1]):
                total += work[i, k] * a[j, k]
            out[i, j] = total
            out[j, i] = total


def multiply_eights(a: Array | Single, b: Array, sign: float, kept: float, out: Array) -> None:
    """Compute out = sign a b + kept out, for a multiple of eight columns.

    Blocks of eight sums in registers allow vector instructions.
    """
    for block in range(out.shape[1] // 8):
        s = 8 * block
        for i in range(a.shape[0]):
            r0, r1, r2, r3 = out[i, s], out[i, s + 1], out[i, s + 2], out[i, s + 3]
            r4, r5, r6, r7 = out[i, s + 4], out[i, s + 5], out[i, s + 6], out[i, s + 7]
            r0, r1, r2, r3 = kept * r0, kept * r1, kept * r2, kept * r3
            r4, r5, r6, r7 = kept * r4, kept * r5, kept * r6, kept * r7
            for j in range(a.shape[1]):
                c = sign * a[i, j]
                r0 += c * b[j, s]
                r1 += c * b[j, s + 1]
                r2 += c * b[j, s + 2]
                r3 += c * b[j, s + 3]
                r4 += c * b[j, s + 4]
                r5 += c * b[j, s + 5]
                r6 += c * b[j, s + 6]
                r7 += c * b[j, s + 7]
            out[i, s], out[i, s + 1], out[i, s + 2], out[i, s + 3] = r0, r1, r2, r3
            out[i, s + 4], out[i, s + 5], out[i, s + 6], out[i, s + 7] = r4, r5, r6, r7

"""Small systems of linear equations, compiled."""

from __future__ import annotations

from lumped.common.compiled import inlined


@inlined
def eliminate(matrix, n, width):
    """Solve n equations in place, matrix (n, n) with right sides in columns n to width.

    Gauss with partial pivoting; a call to LAPACK takes as long to run at this
    size and ten times as long to compile.
    """
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(k, width):
                swap = matrix[k, j]
                matrix[k, j] = matrix[pivot, j]
                matrix[pivot, j] = swap
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k + 1, width):
                matrix[i, j] -= factor * matrix[k, j]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            for column in range(n, width):
                matrix[i, column] -= matrix[i, j] * matrix[j, column]
        for column in range(n, width):
            matrix[i, column] /= matrix[i, i]

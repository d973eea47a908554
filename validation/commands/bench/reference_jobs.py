"""Fixed jobs beside which commands are measured; run in a process of their own.

    python reference_jobs.py compiling
    python reference_jobs.py solving

They use nothing of the project and do not change with it: the processor time of a
command over that of a job is nearly the same on fast and slow machines.
"""

from __future__ import annotations

import sys


def compiling() -> None:
    """Compile one kernel for some types, and keep no machine code."""
    import numba
    import numpy as np

    def largest(row):
        place = 0
        for i in range(row.size):
            if abs(row[i]) > abs(row[place]):
                place = i
        return place

    largest_of = numba.njit(largest)

    def eliminate(matrix, order, scale):
        n = matrix.shape[0]
        for k in range(n):
            pivot = k + largest_of(matrix[k:, k])
            for j in range(k, matrix.shape[1]):
                held = matrix[k, j]
                matrix[k, j] = matrix[pivot, j]
                matrix[pivot, j] = held
            order[k] = pivot
            for i in range(k + 1, n):
                factor = matrix[i, k] / matrix[k, k]
                for j in range(k, matrix.shape[1]):
                    matrix[i, j] -= factor * matrix[k, j]
            scale[k] = np.sqrt(np.abs(matrix[k, k])) + np.exp(-scale[k])
        return matrix[n - 1, n - 1]

    for number in (numba.float64, numba.float32, numba.complex128, numba.complex64):
        for axes in (number[:, ::1], number[::1, :], number[:, :]):
            signature = axes, numba.int64[::1], numba.float64[::1]
            numba.njit(signature)(eliminate)


def solving() -> None:
    """Factorise sparse and dense matrices, and count in Python."""
    import numpy as np
    from scipy.linalg import eig
    from scipy.sparse import diags, identity, kron
    from scipy.sparse.linalg import splu

    n = 22
    line = diags([-1.0, 2.5, -1.0], [-1, 0, 1], shape=(n, n))
    plane = kron(line, identity(n)) + kron(identity(n), line)
    space = kron(plane, identity(n)) + kron(identity(n * n), line)
    factors = splu(space.tocsc())
    for _ in range(20):
        factors.solve(np.ones(n**3))
    eig(np.random.default_rng(1).standard_normal((300, 300)))
    total = 0
    for i in range(6_000_000):
        total += i % 7


JOBS = {"compiling": compiling, "solving": solving}

if __name__ == "__main__":
    JOBS[sys.argv[1]]()

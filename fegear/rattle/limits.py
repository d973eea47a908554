"""How much of a computation of rattle is allowed."""

LEAST_RETURNS, MOST_RETURNS = 100, 10_000_000  # until motions count as settled

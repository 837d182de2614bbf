"""What happens at the two ends of a line of unknowns, in the words that all elliptic solvers share."""

from collections.abc import Sequence

Ends = Sequence[tuple[str, str]]

# (d, w): first row of a line with diagonal d + w σ, its right-hand side times w; inner rows are (2, 1)
END_ROWS = {"neumann": (1.0, 1.0), "dirichlet": (3.0, 1.0), "node": (2.0, 1.0), "node-neumann": (1.0, 0.5)}


def check_ends(n: Sequence[int], ends: Ends) -> tuple[tuple[str, str], ...]:
    """The ends as a tuple of pairs, or ValueError: unknown word, half a periodic axis, fewer than two unknowns."""
    if len(ends) != len(n):
        raise ValueError(f"{len(n)} axes need {len(n)} pairs of ends, got {len(ends)}")
    for a, (pair, k) in enumerate(zip(ends, n, strict=True)):
        unknown = [word for word in pair if word != "periodic" and word not in END_ROWS]
        if len(pair) != 2 or unknown:
            raise ValueError(f"axis {a}: ends {tuple(pair)} are not two of periodic, {', '.join(END_ROWS)}")
        if (pair[0] == "periodic") != (pair[1] == "periodic"):
            raise ValueError(f"axis {a}: both ends are periodic or none, got {tuple(pair)}")
        if k < 2:
            raise ValueError(f"axis {a}: at least 2 unknowns, got {k}")
    return tuple((low, high) for low, high in ends)


def is_singular(ends: Ends) -> bool:
    """Whether a constant is a solution of the homogeneous problem."""
    return all(word in ("periodic", "neumann", "node-neumann") for pair in ends for word in pair)

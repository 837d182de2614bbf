"""The solver core: NumPy and Numba only; it knows no body and no scene."""

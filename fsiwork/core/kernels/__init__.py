"""Row kernels: each walks contiguous rows and its body is one formula, the same in 2D and 3D.

Every kernel takes flat padded arrays, the flat ``start`` of each row, the row's length ``n`` and the
strides of the directions it differentiates along (see `fsiwork.core.grid.Grid`).
"""

from numba import njit

# `fastmath=True` would fold isnan to False: a diverged run would look healthy. These four do not.
FASTMATH = {"contract", "arcp", "nsz", "reassoc"}

loop = njit(parallel=True, error_model="numpy", fastmath=FASTMATH, cache=True)
"""Decorator of a kernel over rows (`prange` over ``start``)."""

point = njit(error_model="numpy", fastmath=FASTMATH)
"""Decorator of a formula at one point; keep it in the file of the kernels that call it
(the disk cache does not notice an edit in another file)."""

"""Numba's threads and cache folder are set before any test imports it, in every worker of pytest-xdist too."""

import os

from fsiwork import provenance

CACHE = provenance.prepare(threads=1)
os.environ.setdefault("OMP_NUM_THREADS", "1")

"""What the book consists of (``configs/book.yaml``, ``configs/studies/*.yaml``) and the names of its results.

Light on purpose (standard library and PyYAML): the rules import it, and `snakemake -n` is to stay quick.
"""

from fsiwork.targets.book import Check, Entry
from fsiwork.targets.plan import Plan
from fsiwork.targets.reading import SIZES, Faults
from fsiwork.targets.studies import Point, Study

__all__ = ["SIZES", "Check", "Entry", "Faults", "Plan", "Point", "Study"]

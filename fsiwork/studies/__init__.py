"""Datasets in, datasets and numbers out: convergence, stability, trade-off, exact solutions."""

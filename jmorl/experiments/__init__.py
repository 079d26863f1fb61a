"""Comparisons of methods: their runs, the records of these, statistics, tables, and `compare`, which makes them all."""

from jmorl.experiments.comparison import Comparison, Contender, compare

__all__ = ["Comparison", "Contender", "compare"]

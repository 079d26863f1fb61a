"""The paper's experiments, in its units and in honest ones; and the same comparison for other people's methods."""

from jmorl.paper.compare import Comparison, Method, compare

__all__ = ["Comparison", "Method", "compare"]

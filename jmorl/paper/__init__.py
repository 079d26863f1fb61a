"""The paper's experiments, in its units and in honest ones."""

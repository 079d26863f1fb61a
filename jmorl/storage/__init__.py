"""What stays on disk: the run folder, and policies as files that need nothing but NumPy."""

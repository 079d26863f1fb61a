"""Numbers, fronts and policies as people read them, in questions and reports alike."""

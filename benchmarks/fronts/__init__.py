"""Fronts on the tasks of PGMORL's authors, beside published ones."""

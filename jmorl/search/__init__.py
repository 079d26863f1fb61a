"""The host side of the search: archive, buffer, prediction, bounds, selection. NumPy only, any number of objectives."""

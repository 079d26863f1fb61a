"""A web page on which a person steers the search. The README explains it under "The studio"."""

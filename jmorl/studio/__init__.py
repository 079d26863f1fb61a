"""A web page on which a person steers the search; its parts are told in the README, "The studio"."""

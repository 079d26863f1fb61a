"""Studies: what users of many kinds get from each method, and what it asks of them."""

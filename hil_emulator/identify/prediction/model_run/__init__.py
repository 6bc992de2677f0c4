"""Compiled loops that run the model along a recording; the filter and the benches use them."""

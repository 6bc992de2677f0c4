"""The configuration: TOML files in, one frozen, range-checked object out.

The schema is derived from the declarations of the model; nothing is listed twice.
"""

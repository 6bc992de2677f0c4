"""Virtual bench tests: the procedures of the documents, performed on the emulated actuator.

One file per test. Each gives a table, a picture, and a comparison of its numbers with the expected
ones; `registry.characterise` performs the tests and writes one page.
"""

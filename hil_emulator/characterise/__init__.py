"""Virtual bench tests: the procedures of the documents, performed on the emulated actuator.

One file per test. Each gives a table, a picture, and its numbers beside those it should
reproduce; `registry.characterise` performs them and writes one page.
"""

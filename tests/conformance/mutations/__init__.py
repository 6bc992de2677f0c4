"""Mutants by service, written from CiA 301 and CiA 305, independent of the cases.

The mutants in `clauses_*` were written clause by clause, before the suite was run on them.
"""

from mutations import (
    clauses_access,
    clauses_data,
    clauses_errors,
    error_control,
    lss,
    network,
    nmt,
    pdo,
    sdo,
)
from mutations.mutant import MUTANTS

__all__ = [
    "MUTANTS",
    "clauses_access",
    "clauses_data",
    "clauses_errors",
    "error_control",
    "lss",
    "network",
    "nmt",
    "pdo",
    "sdo",
]

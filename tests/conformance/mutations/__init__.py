"""Mutants by service, written from CiA 301 and CiA 305, not from the cases."""

from mutations import error_control, lss, network, nmt, pdo, sdo
from mutations.mutant import MUTANTS

__all__ = ["MUTANTS", "error_control", "lss", "network", "nmt", "pdo", "sdo"]

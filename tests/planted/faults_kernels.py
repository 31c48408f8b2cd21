"""Faults of kernels: one in each family at least, each on one of several ways only."""
from faults import Fault

FAULTS = [
]

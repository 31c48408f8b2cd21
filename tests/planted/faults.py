"""What a fault is."""
import dataclasses


@dataclasses.dataclass(frozen=True)
class Fault:
    name: str
    area: str  # a rule, a family of kernels, a way of storing or reading
    file: str
    old: str  # is there exactly once
    new: str
    means: str
    laws: str = ""  # operations whose laws are asked; all where none is named

"""How images are evaluated, for all that is computed inside a `with` block."""
import contextlib
import contextvars

from . import _core
from .errors import UsageError

_current = contextvars.ContextVar("tessera.options", default={})
_UNITS = {"": 1, "K": 1 << 10, "M": 1 << 20, "G": 1 << 30}


def _bytes_of(memory):
    if isinstance(memory, str):
        text = memory.strip().upper()
        for end in ("IB", "B"):
            if text.endswith(end):
                text = text[:-len(end)]
                break
        unit = text[-1:] if text[-1:] in ("K", "M", "G") else ""
        try:
            memory = float(text[:len(text) - len(unit)]) * _UNITS[unit]
        except ValueError:
            raise UsageError("memory", f'found "{memory}", expected bytes or text like "2G"') from None
    if memory <= 0:
        raise UsageError("memory", f"found {memory}, expected more than 0 bytes")
    return int(memory)


class _Bar:
    """A progress function that moves a bar of tqdm's; one bar for all evaluations, from the start each."""

    def __init__(self, bar=None):
        self.bar, self.own = bar, bar is None

    def __call__(self, share):
        if self.bar is None:
            from tqdm.auto import tqdm
            self.bar = tqdm(total=100, unit="%", bar_format="{l_bar}{bar}| {elapsed}<{remaining}")
        at = share * (self.bar.total or 1)
        if at < self.bar.n:
            self.bar.reset()
        self.bar.update(at - self.bar.n)

    def close(self):
        """A bar that somebody gave stays theirs."""
        if self.own and self.bar is not None:
            self.bar.close()


def _progress_of(progress):
    if progress is True:
        try:
            import tqdm.auto  # noqa: what there is no bar without
        except ImportError:
            raise UsageError("progress", "found True without the package tqdm, expected a function") from None
        return _Bar()
    if hasattr(progress, "update") and hasattr(progress, "total") and hasattr(progress, "n"):
        return _Bar(progress)
    if not callable(progress):
        raise UsageError("progress", f"found {progress!r}, expected a function of the share done, a tqdm bar or True")
    return progress


@contextlib.contextmanager
def options(*, threads=None, memory=None, target=None, progress=None, optimize=None, rules_off=None, tile=None):
    """Options of all that is computed inside the block, by this thread or task. Results do not depend on them.

    threads: 0, the default, is every core.
    memory: bytes that buffers may take together, as a number or "2G"; 512 MiB.
    target: a compiled instruction set of `tessera.targets()`. It holds for the whole process until the block
        ends, so nothing else should compute meanwhile.
    progress: called in the calling thread with the share done, 0 to 1, some fifty times a second; False
        cancels, an exception cancels and is raised. Or a bar of tqdm's, or True for one of its own, in a terminal
        as in a notebook.
    optimize: False computes operation by operation, for comparison.
    rules_off: names of rewrite rules that are not applied, or ["all"].
    tile: (width, height) of tiles; the planner's choice.
    """
    mine = dict(_current.get())
    if threads is not None:
        if not 0 <= threads <= 4096:
            raise UsageError("threads", f"found {threads}, expected 0 to 4096")
        mine["threads"] = int(threads)
    if memory is not None:
        mine["memory"] = _bytes_of(memory)
    if progress is not None:
        mine["progress"] = _progress_of(progress)
    if optimize is not None:
        mine["optimize"] = bool(optimize)
    if rules_off is not None:
        mine["rules_off"] = [rules_off] if isinstance(rules_off, str) else list(rules_off)
    if tile is not None:
        mine["tile_width"], mine["tile_height"] = tile
    before = _core.target() if target is not None else None
    if target is not None:
        _core.set_target(target)
    token = _current.set(mine)
    try:
        yield
    finally:
        _current.reset(token)
        if progress is not None and isinstance(mine["progress"], _Bar):
            mine["progress"].close()
        if before is not None:
            _core.set_target(before)


def current():
    """The options that hold here, for the compiled half."""
    return _current.get()

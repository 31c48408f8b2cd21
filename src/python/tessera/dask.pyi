from typing import Any, Callable, Mapping, Sequence

from . import Graph, Image

def apply(graph: Graph | Image | Callable[..., Any], *arrays: Any, chunks: Any = None, dtype: Any = None,
          channels: str | Sequence[str] | Mapping[str, str | Sequence[str]] | None = None, threads: int = 1,
          **named: Any) -> Any: ...
def image(array: Any, channels: str | Sequence[str] | None = None) -> Image: ...

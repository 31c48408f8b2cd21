# %% [markdown]
# # A picture that is larger than a machine: Dask
# The engine says which pixels of the inputs a chunk needs, Dask says where it is computed. No seams, the bits of one machine.

# %%
import os

import numpy as np
import tessera as ts

SIZE = int(os.environ.get("TESSERA_NOTEBOOK_SIZE", 4096))
CHUNK = max(32, SIZE // 4)
try:
    import dask.array as da
except ImportError:
    raise SystemExit("this page needs Dask")

# %% [markdown]
# A plate that no memory has to hold: every chunk is made when it is needed. From files it is `da.from_zarr("plate.zarr")`.

# %%
plate = ts.dask.apply(ts.clouds((SIZE, SIZE), 3, octaves=6), chunks=CHUNK)
look = ts.graph(lambda image: image.saturate(1.2).hue(20).blur(sigma=3, method="direct").resize(
    (SIZE // 8, SIZE // 8)))
small = ts.dask.apply(look, plate, chunks=CHUNK // 8)
print(plate, small, sep="\n")

# %% [markdown]
# On a cluster: `from distributed import Client; Client("scheduler:8786")`, and the same line.

# %%
pixels = small.compute(scheduler="threads")
assert np.array_equal(pixels, np.asarray(look(ts.clouds((SIZE, SIZE), 3, octaves=6))))
ts.from_array(pixels)

# %% [markdown]
# What needs all of an array is refused, with what to do instead:

# %%
try:
    ts.dask.apply(lambda image: image.blur(sigma=40, method="recursive"), plate)
except ts.DataError as error:
    print(error)

# %% [markdown]
# Sums over all of it, and files, take it row by row:

# %%
mean = ts.dask.image(small).mean()
print(np.asarray(mean))
ts.dask.image(small).write("small.tif", dtype="uint16")

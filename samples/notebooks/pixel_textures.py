# %% [markdown]
# # Tables: pixel textures from functions and volumes
# A look-up takes its coordinates from an image's channels. What it looks up is a function, an image, or a volume.

# %%
import os

import numpy as np
import tessera as ts

SIZE = int(os.environ.get("TESSERA_NOTEBOOK_SIZE", 512))
coordinates = ts.ramp((SIZE, SIZE), 2)  # s to the right, t downwards

# %% [markdown]
# A function of two variables, tabulated once, evaluated by interpolation:

# %%
waves = ts.table_of(lambda s, t: 0.5 + 0.5 * np.sin(40 * s * t), (257, 257))
picture = coordinates.lookup(waves, dims=2, filter="cubic", align="ends")
exact = 0.5 + 0.5 * np.sin(40 * np.prod(np.asarray(coordinates), axis=-1, keepdims=True))
print(ts.compare(picture, exact.astype(np.float32)))
picture

# %% [markdown]
# A slice of a volume at any angle: the coordinates say where.

# %%
n = 48
z, y, x = (np.mgrid[0:n, 0:n, 0:n] + 0.5) / n - 0.5
density = np.exp(-40 * (np.sqrt(x * x + y * y) - 0.3) ** 2 - 30 * z * z).astype(np.float32)
s, t = np.moveaxis(np.asarray(coordinates), -1, 0)
tilt = np.stack([s, t, 0.5 + 0.6 * (s - 0.5)], -1).astype(np.float32)
inside = ts.from_array(tilt).lookup(ts.volume_of(density), dims=3, slices=n)
inside.colormap("inferno")

# %%
assert 0.9 < np.asarray(inside).max() <= 1

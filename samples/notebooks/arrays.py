# %% [markdown]
# # Arrays and lazy images
# An array is an image, an image is an array. Between them nothing is computed until pixels are asked for.

# %%
import os

import numpy as np
import tessera as ts

SIZE = int(os.environ.get("TESSERA_NOTEBOOK_SIZE", 1024))
y, x = np.mgrid[0:SIZE, 0:SIZE] / SIZE
array = np.stack([x, y, 0.5 + 0.5 * np.sin(40 * x * y)], -1).astype(np.float32)
image = ts.from_array(array)  # the same memory, whatever its strides

# %% [markdown]
# Operations are methods, named and documented as on the command line: `help(ts.Image.blur)`.

# %%
soft = image.saturate(1.4).hue(40).blur(sigma=SIZE / 200) * [1, 0.9, 0.8]
soft

# %% [markdown]
# `explain` tells what will run, `render` runs it, `verify` compares it with a reference in double precision.

# %%
print(soft.explain())
pixels = soft.render(dtype="uint8")
print(pixels.shape, pixels.dtype, soft.stats["seconds"])
print(soft.verify())

# %% [markdown]
# Parts and channels, into an array of yours:

# %%
out = np.empty((SIZE // 4, SIZE // 2, 1), np.float32)[:, ::-1]
soft[: SIZE // 4, : SIZE // 2]["G"].render(out=out)
assert np.array_equal(out[..., 0], np.asarray(soft)[: SIZE // 4, : SIZE // 2, 1])

# %% [markdown]
# Two images side by side, with numbers:

# %%
ts.compare(image, soft)

# %% [markdown]
# # Textures for a game
# A rock that repeats: colours, height, normals, ambient occlusion and the levels of its mip chain, all from noise.

# %%
import os

import numpy as np
import tessera as ts

SIZE = int(os.environ.get("TESSERA_NOTEBOOK_SIZE", 512))
rough = ts.perlin((SIZE, SIZE), 1, freq=6, octaves=8, seed=3)
cracks = ts.cell((SIZE, SIZE), 1, freq=9, seed=4)
height = (rough * 0.7 + cracks * 0.3).tileable(blend=0.2)
height

# %% [markdown]
# Edges meet: twice beside itself there is no seam.

# %%
twice = np.tile(np.asarray(height), (2, 2, 1))
inner, seam = np.abs(np.diff(twice[:, : SIZE - 1, 0], axis=1)), np.abs(twice[:, SIZE, 0] - twice[:, SIZE - 1, 0])
print(f"steps between columns: inside {inner.mean():.4f}, across the edge {seam.mean():.4f}")
assert seam.mean() < 2.5 * inner.mean()
ts.from_array(twice)

# %% [markdown]
# What a game engine takes beside the colours, all of one graph:

# %%
normals = height.normalmap(scale=SIZE / 20, wrap="periodic", pack=True)
occlusion = height.heighttoao()
albedo = height.autolevels()[..., [0, 0, 0]] * [0.75, 0.6, 0.5] + [0.12, 0.1, 0.09]
shaded = albedo * occlusion[..., [0, 0, 0]]
normals

# %%
albedo.write("rock_albedo.png", dtype="uint8")
normals.write("rock_normal.png", dtype="uint8")
for level in range(3):
    albedo.mip(level=level).write(f"rock_albedo_{level}.png", dtype="uint8")
print(ts.read("rock_albedo_2.png"))
shaded

# %% [markdown]
# # New light from AOVs
# A renderer's positions and normals are images. With them light, fog and outlines are changed after rendering.
# Here a ball over a floor stands in for the renderer.

# %%
import os

import numpy as np
import tessera as ts

SIZE = int(os.environ.get("TESSERA_NOTEBOOK_SIZE", 1024))
WIDTH, HEIGHT = SIZE, SIZE * 9 // 16

# %% Rays from an eye at (0, 1, 4) against a ball of radius 1 at (0, 1, 0) and the floor y = 0
v, u = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
ray = np.stack([(u - WIDTH / 2) / HEIGHT * 1.2, (HEIGHT / 2 - v) / HEIGHT * 1.2, -np.ones((HEIGHT, WIDTH))], -1)
ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
eye, centre = np.array([0.0, 1.0, 4.0]), np.array([0.0, 1.0, 0.0])
b = (ray * (eye - centre)).sum(-1)
disc = b * b - ((eye - centre) ** 2).sum() + 1
ball = np.where(disc > 0, -b - np.sqrt(np.maximum(disc, 0)), np.inf)
with np.errstate(divide="ignore"):
    floor = np.where(ray[..., 1] < 0, -eye[1] / ray[..., 1], np.inf)
distance = np.minimum(ball, np.minimum(floor, 60))
at = eye + ray * distance[..., None]
is_ball = (ball < floor) & (ball < 60)
up = np.broadcast_to([0.0, 1.0, 0.0], at.shape)
positions = ts.from_array(at.astype(np.float32), channels="X,Y,Z")
normals = ts.from_array(np.where(is_ball[..., None], at - centre, up).astype(np.float32))

# %% [markdown]
# Two lights of different colours, one of them with a highlight, in one pass:

# %%
key = normals.phong(light=[1, 1, 1], exponent=40) * [1.0, 0.85, 0.6]
fill = normals.phong(light=[-1, 0.4, 0.3]) * [0.15, 0.25, 0.45]
colors = ts.from_array(np.where(is_ball[..., None], [0.8, 0.2, 0.1], [0.5, 0.5, 0.5]).astype(np.float32))
lit = colors * (key + fill)[..., [0, 1, 2]]
lit

# %% [markdown]
# Fog that is denser near the floor, from the positions; nothing is rendered again.

# %%
foggy = lit.layerfog(positions, layers=[0, 0.25, 0.6, 0.02], eye=list(eye), color=[0.5, 0.6, 0.7])
foggy

# %%
assert np.isfinite(np.asarray(foggy)).all()
ts.compare(lit, foggy)

# %% [markdown]
# # Wind: a line integral convolution on a map
# Streamlines everywhere at once, on degrees of longitude and latitude, with axes and a bar of speeds. With xarray the
# dataset of a NetCDF file does it by the names of its variables: `xr.open_dataset("era5.nc").tessera.lic_plot("u10", "v10")`.

# %%
import os

import numpy as np
import tessera as ts

SIZE = int(os.environ.get("TESSERA_NOTEBOOK_SIZE", 1024))
lon = (np.arange(SIZE) + 0.5) * 360 / SIZE
lat = 90 - (np.arange(SIZE // 2) + 0.5) * 360 / SIZE

# %% Westerlies and trade winds, and three storms that turn as the hemisphere has them
phi, theta = np.radians(lat)[:, None], np.radians(lon)[None, :]
u = 12 * np.sin(3 * np.abs(phi)) * np.cos(phi) + 0 * theta
v = 2 * np.sin(4 * theta) * np.cos(phi)
for storm_lat, storm_lon, speed in ((25, 290, 30), (15, 130, 35), (-20, 60, 30)):
    east = ((lon[None, :] - storm_lon + 180) % 360 - 180) * np.cos(phi)
    north = lat[:, None] - storm_lat
    r = np.hypot(east, north)
    swirl = np.sign(storm_lat) * speed * (r / 6) * np.exp(1 - r / 6) / np.maximum(r, 1e-3)
    u, v = u - swirl * north, v + swirl * east
land = (np.sin(3 * theta + 2.2) * np.cos(2 * phi) > 0.85) & (np.abs(phi) < 1.2)
u, v = (np.ma.masked_array(a, np.broadcast_to(land, a.shape)) for a in (u, v))

# %% [markdown]
# Lines of a whole map cross the date line; masked places stay empty.

# %%
texture = ts.fields.lic_of(u, v, lon, lat, geographic=True, length=SIZE / 60)
ts.from_array(np.nan_to_num(texture))

# %%
try:
    from matplotlib import pyplot
except ImportError:
    pyplot = None
if pyplot is not None:
    pyplot.figure(figsize=(10, 5))
    ts.lic_plot(u, v, lon, lat, geographic=True, label="m/s", length=SIZE / 60)
    pyplot.savefig("wind.png", dpi=max(20, SIZE // 10))

# %% [markdown]
# The same from a dataset: dimensions, coordinates and masks stay.

# %%
try:
    import xarray as xr
except ImportError:
    xr = None
if xr is not None:
    ts.xarray  # adds the accessor, since xarray came after tessera
    grid = (("lat", "lon"), u.filled(np.nan)), (("lat", "lon"), v.filled(np.nan))
    ds = xr.Dataset({"u10": grid[0], "v10": grid[1]}, {"lat": lat, "lon": lon})
    lines = ds.tessera.lic("u10", "v10", length=SIZE / 60)
    assert np.array_equal(lines, texture, equal_nan=True)
    print(lines)

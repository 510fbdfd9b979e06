"""
Results in xarray and pandas
============================

A result is a netCDF-4 file: xarray opens it with names and units, pandas makes a table of it. The pendulum is the first
benchmark of the IFToMM, a mass of 1 kg on a rod of 1 m, released from the horizontal; its place after ten seconds is
known in closed form.

Source: IFToMM Technical Committee for Multibody Dynamics, Library of Computational Benchmark Problems, A01 simple
pendulum; by elliptic functions it is at (-0.275087462576, -0.961419205099) m after 10 s.
"""

import matplotlib.pyplot as plt
import numpy as np
import xarray

import ffr_dyn as fd

mass = fd.rigid_body("mass", mass=1.0, inertia=(1e-9, 1e-9, 1e-9), points={"pivot": (1, 0, 0), "c": (0, 0, 0)})
pivot = fd.Joint("pivot", "revolute", "ground.O", "mass.pivot")
scene = fd.Scene([fd.Body("mass", mass, position=(-1, 0, 0))], [pivot], ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0))
fd.forward(scene, end=10.0, output_step=0.01, method=fd.RK4(1e-3), check=False, path="out/pendulum.nc")

data = xarray.open_dataset("out/pendulum.nc", engine="h5netcdf")
print(data["mass.c.position"].sel(time=10.0, method="nearest").to_series())  # by names, in m
table = data["mass.c.position"].to_pandas()  # a row for each time, a column for each direction
table.plot(y=["x", "y"], xlabel="time [s]", ylabel="place of the mass [m]")
longest = table["x"].diff().abs().idxmax()
print(table.describe(), f"the mass is fastest along x at {longest} s", sep="\n")
plt.axvline(longest, color="k", linestyle=":")
assert np.allclose(table.loc[10.0], (-0.275087462576, -0.961419205099, 0), atol=1e-8)

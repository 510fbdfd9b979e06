"""The engine: compiled (numba) kernels that read the tables made by `ffr_dyn.compile.scene_tables`.

Read in this order: `tables` (what the kernels read and write), `vectors`, `bodies` (inertia, quadratic velocity terms,
Schur complement; `planar` where they stay in a plane), `markers`, `loads`, `rows` (constraints), `blocks` (sparse
factorisation of the multiplier system), `system` (one evaluation of the equations of motion), `solution` (accelerations and
multipliers from it). Each has a readable twin in numpy that the tests hold it to: `ffr_dyn.equations.inertia`,
`ffr_dyn.equations.kinematics`, `ffr_dyn.equations.constraints`.

Twin: `ffr_dyn.equations.motion.equations_of_motion`.
"""

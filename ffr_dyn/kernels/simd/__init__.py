"""The wall before numba's inner parts: vectors of eight, arrays at addresses, calls of addresses.

Only here is code written for the compiler below numba, and only `intrinsics` imports what numba keeps to itself. Where that
is not as expected, or on request (FFR_DYN_PLAIN=1 in the environment, for diagnosis), plain forms of the same functions run.
"""

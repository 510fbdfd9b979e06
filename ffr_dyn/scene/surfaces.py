"""The surface of a body as it is computed: with its second order where the body has one."""

from __future__ import annotations

from ffr_dyn.scene.scene import Body
from ffr_prep.body import Surface, linear_surface


def surface_of(body: Body) -> Surface | None:
    """In the body's own frame; None of a body without a surface."""
    surface = (body.frame.model if body.frame else body.model).surface
    if surface is None or (body.stiffening and body.model.stiffening is not None):
        return surface
    return linear_surface(surface)

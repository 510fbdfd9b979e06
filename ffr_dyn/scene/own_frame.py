"""The frame that a body has of its own while it is computed in its mean-axis form.

The reference conditions of a body say what its position, rotation and elastic coordinates refer to, in a scene and in
results. A body with a second-order displacement is computed in its mean-axis form all the same (`ffr_prep.body.mean_axis`),
in which its own frame is a marker that moves with the elastic field.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from ffr_prep.body import FlexibleBody, FrameMarker
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief


@dataclass(frozen=True, repr=False)
class OwnFrame(Brief):
    """How a body in its mean-axis form, with m elastic coordinates q, is seen from its own frame.

    model  : the body as it was, with n elastic coordinates;  C : (n, m), these are C q
    marker : its frame in the mean-axis form
    """

    model: FlexibleBody
    marker: FrameMarker
    C: Array

    def combined(self, V: Array) -> OwnFrame:
        """For other coordinates p, q = V p, V (m, k)."""
        old = self.marker
        marker = replace(old, phi_t=old.phi_t @ V, phi_r=old.phi_r @ V, K=V.T @ old.K @ V)
        return replace(self, marker=marker, C=self.C @ V)

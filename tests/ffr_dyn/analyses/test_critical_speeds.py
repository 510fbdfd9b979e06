"""Critical speeds do not depend on the speeds of the diagram."""

from __future__ import annotations

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.analyses.rotating.campbell import _at_speeds, _off_order
from ffr_dyn.linear.spectrum import followed


def rotor() -> fd.Scene:
    """A disc in the middle of a shaft in two bearings that are equally stiff all around."""
    at = {"left": (0, 0, 0), "middle": (0.5, 0, 0), "right": (1, 0, 0)}
    line = fp.polyline([at["left"], at["right"]], fp.Member(fp.circle(0.04), fp.material("steel")), elements=24)
    model = fp.from_frame(fp.named(line, **at), [fp.InterfaceRegion(name) for name in at])
    shaft = fp.reduce(model, fp.Request(name="shaft", reference=fp.MeanAxis(), reduction=fp.CraigBampton(6)))
    disc = fd.rigid_body("disc", mass=20.0, inertia=(0.3, 0.15, 0.15), points={"c": (0, 0, 0)})
    bodies = [
        fd.Body("shaft", shaft, omega_bar=(1, 0, 0)),
        fd.Body("disc", disc, position=at["middle"], omega_bar=(1, 0, 0)),
    ]
    hub = fd.Joint("hub", "fixed", "shaft.middle", "disc.c")
    k = (1e7, 1e7, 1e7, 0, 0, 0)
    bearings = [fd.Bushing(f"at_{side}", f"ground.{side}", f"shaft.{side}", k) for side in ("left", "right")]
    return fd.Scene(bodies, [hub], forces=bearings, ground=at)


def test_how_far_a_whirl_is_from_the_speed_is_smooth_where_it_stands_still():
    """In the turning axes its eigenvalue is real there, by rounding, and says nothing of how fast it is seen."""
    at, off = _at_speeds(rotor(), "", 0.0), _off_order(True, 1.0)
    near = at(200.0, None)
    m = near.names.index("shaft: first bending, forward")
    critical = 200.0 + off(200.0, followed(near, at(200.0, near)), m)
    for _ in range(3):
        critical += off(critical, followed(near, at(critical, near)), m)
    beside = critical + np.array([-1e-2, -1e-4, -1e-5, 0.0, 1e-5, 1e-4, 1e-2])
    found = [off(speed, followed(near, at(speed, near)), m) for speed in beside]
    np.testing.assert_allclose(found, critical - beside, atol=1e-3)


def test_critical_speeds_do_not_depend_on_the_list_of_speeds():
    found = [fd.campbell(rotor(), speeds=np.linspace(*speeds), modes=2) for speeds in ((0, 800, 21), (100, 300, 3))]
    one, other = ({of["mode"]: of["speed"] for of in result.attributes["critical"]} for result in found)
    assert one == pytest.approx(other, rel=1e-6)
    assert len(one) == 2

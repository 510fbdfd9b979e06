"""Many runs at once: each is that of its scene alone, whatever goes on beside it."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import cloud

import ffr_dyn as fd
from ffr_dyn.functions.together import alone
from ffr_prep.common.errors import ComputationError, InputError

SOFT = cloud(4, seed=1)
HOW = {"end": 0.2, "output_step": 0.01, "method": fd.ROS2(1e-3)}


def swinging(spin: float = 6.0, g: float = 9.81, *more: fd.Load) -> fd.Scene:
    body = fd.Body("rod", SOFT, omega_bar=(0.0, 0.0, spin), damping=0.02)
    hinge = fd.Joint("hinge", "revolute", "ground.O", "rod.a", axis=(0, 0, 1))
    return fd.Scene((body,), (hinge,), ground={"O": (0, 0, 0)}, gravity=(0.0, -g, 0.0), loads=more)


def falling() -> fd.Scene:
    """Of another structure."""
    return fd.Scene((fd.Body("stone", fd.rigid_body("stone", mass=1.0, inertia=np.eye(3))),), gravity=(0, 0, -9.81))


def equal(one: fd.Result, other: fd.Result) -> bool:
    same = one.time.tobytes() == other.time.tobytes() and list(one.quantities) == list(other.quantities)
    return same and all(one[name].tobytes() == other[name].tobytes() for name in one.quantities)


@pytest.mark.parametrize("threads", [1, 2, 7])
def test_every_run_is_that_of_its_scene_alone(threads):
    """Scenes of one structure and of others, one of them with a Python function."""
    pushed = fd.Load("push", "rod.b", function=lambda t, state: (np.sin(t), 0.0, 0.0, 0.0, 0.0, 0.0))
    scenes = [*(swinging(spin, g) for spin in (1.0, 6.0) for g in (0.0, 9.81)), falling(), swinging(2.0, 1.0, pushed)]
    alone_each = [fd.forward(scene, check=False, **HOW) for scene in scenes]
    seen: list[tuple[int, int]] = []
    found = fd.forward_many(scenes, threads=threads, progress=lambda k, n: seen.append((k, n)), **HOW)
    assert all(equal(one, other) for one, other in zip(found, alone_each, strict=True))
    assert [one.attributes for one in found] == [one.attributes for one in alone_each]
    assert seen == [(k, len(scenes)) for k in range(1, len(scenes) + 1)]


def test_a_scene_that_fails_leaves_the_others_alone():
    def torn(t, state):
        if t > 0.1:
            raise ValueError("the rope has torn")
        return (0.0,) * 6

    torn_one = swinging(6.0, 9.81, fd.Load("rope", "rod.b", function=torn))
    first, failed, second = fd.forward_many([swinging(), torn_one, swinging(1.0)], threads=2, **HOW)
    assert equal(first, fd.forward(swinging(), check=False, **HOW))
    assert isinstance(second, fd.Result)
    assert isinstance(failed, ComputationError)
    assert "the rope has torn" in str(failed)
    assert "t = 0.1" in str(failed)
    late = fd.forward_many([swinging()], **{**HOW, "method": fd.ROS2(3e-3)})
    assert isinstance(late[0], InputError)
    assert "not a multiple" in str(late[0])


def test_each_run_has_its_file(tmp_path):
    paths = [tmp_path / f"{k}.nc" for k in range(3)]
    found = fd.forward_many([swinging(k) for k in range(3)], paths=paths, **HOW)
    assert all(equal(fd.load_result(path), one) for path, one in zip(paths, found, strict=True))
    with pytest.raises(InputError, match="3 scenes need as many paths, each another; there are 1"):
        fd.forward_many([swinging()] * 3, paths=paths[:1] * 3, **HOW)
    with pytest.raises(InputError, match="there cannot be 0 threads"):
        fd.forward_many([swinging()], threads=0, **HOW)


def test_a_batch_that_is_interrupted_ends_its_runs(tmp_path):
    """What has run is returned to nobody, but files are whole; no run goes on."""

    def stop(done, total):
        raise KeyboardInterrupt

    paths = [tmp_path / f"{k}.nc" for k in range(40)]
    scenes = [swinging(0.1 * k) for k in range(40)]
    with pytest.raises(KeyboardInterrupt):
        fd.forward_many(scenes, paths=paths, threads=2, progress=stop, **{**HOW, "end": 2.0})
    assert any(fd.load_result(path).attributes["status"] == "complete" for path in paths if path.exists())
    assert not all(path.exists() for path in paths)


def test_a_checked_run_that_is_interrupted_says_what_it_holds(tmp_path):
    def stop(time):
        if time > 0.02:
            raise KeyboardInterrupt("SIGINT")

    path = tmp_path / "run.nc"
    how = {**HOW, "method": fd.ROS2(1e-5), "end": 10.0}
    with pytest.raises(KeyboardInterrupt) as caught:
        fd.forward(swinging(), check=True, path=path, progress=stop, **how)
    assert caught.value.__notes__ == [f"{path} holds what was computed until then"]
    assert fd.load_result(path).attributes["status"] == "stopped: SIGINT"


@pytest.mark.parametrize("method", [fd.ROS3(1e-3), fd.RK4(1e-4), None])
def test_the_error_of_a_run_is_the_same_by_runs_beside_one_another(method):
    how = {**HOW, "method": method, "check": True}
    beside = fd.forward(swinging(), **how)
    with alone():
        after = fd.forward(swinging(), **how)
    assert equal(beside, after)
    assert beside.attributes == after.attributes
    assert beside.attributes["errors"]

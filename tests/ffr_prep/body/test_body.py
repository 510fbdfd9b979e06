"""The body: its guards, its rigid and truncated forms, and its file."""

import io
import json
import zipfile
from dataclasses import fields, replace

import numpy as np
import pytest

from ffr_prep.body import BodyError, FlexibleBody, Interface, Surface, load_body, rigid_body, save_body, truncated
from ffr_prep.body import file as body_file
from ffr_prep.common.errors import ComputationError


def some_body(n=3):
    """A consistent body without finite elements: random modes on twenty point masses."""
    rng = np.random.default_rng(7)
    masses, r = rng.uniform(0.5, 1.5, 20), rng.normal(size=(20, 3))
    Phi = rng.normal(size=(60, n))
    Phi = np.linalg.qr(np.sqrt(np.repeat(masses, 3))[:, None] * Phi)[0] / np.sqrt(np.repeat(masses, 3))[:, None]
    Phi = Phi.reshape(20, 3, n)
    PP = np.einsum("a,aki,alj->klij", masses, Phi, Phi)
    return FlexibleBody(
        name="ünit",
        mass=masses.sum(),
        r_dm=masses @ r,
        rr_dm=np.einsum("a,ak,al->kl", masses, r, r),
        P_dm=np.einsum("a,akj->kj", masses, Phi),
        rP_dm=np.einsum("a,ak,alj->klj", masses, r, Phi),
        PP_dm=(PP + PP.transpose(1, 0, 3, 2)) / 2,
        omega2=np.arange(1.0, n + 1) * 1e4,
        interfaces=(
            Interface("left", r[0], Phi[0], rng.normal(size=(3, n)), "rigid"),
            Interface("right", r[1], Phi[1], rng.normal(size=(3, n)), "mean"),
        ),
        surface=Surface(r[:4], [[0, 1, 2], [0, 2, 3]], Phi[:4]),
        provenance={"modes": n, "warnings": ["a", "b"], "nested": {"x": 1.5, "none": None}},
    )


def assert_same(one, two):
    for f in fields(FlexibleBody):
        if f.name not in ("interfaces", "surface"):
            np.testing.assert_equal(getattr(two, f.name), getattr(one, f.name))
    for a, b in zip(one.interfaces, two.interfaces, strict=True):
        assert (a.name, a.kind) == (b.name, b.kind)
        for key in ("position", "phi_t", "phi_r"):
            assert getattr(a, key).tobytes() == getattr(b, key).tobytes()
    assert (one.surface is None) == (two.surface is None)
    if one.surface is not None:
        for key in ("points", "triangles", "Phi"):
            assert getattr(one.surface, key).tobytes() == getattr(two.surface, key).tobytes()


# ---- the file -----------------------------------------------------------------------------------------------------


def test_the_file_keeps_every_bit(tmp_path):
    body = some_body()
    again = load_body(save_body(body, tmp_path / "new" / "folder" / "b.ffr"))
    assert_same(body, again)
    assert again.PP_dm.tobytes() == body.PP_dm.tobytes()
    assert [path.name for path in (tmp_path / "new" / "folder").iterdir()] == ["b.ffr"]


@pytest.mark.parametrize("body", [some_body(0), rigid_body("r", mass=2.0, inertia=(1, 1, 1))], ids=["empty", "rigid"])
def test_a_rigid_body_is_kept_too(body, tmp_path):
    assert_same(body, load_body(save_body(body, tmp_path / "b.ffr")))


def test_writing_twice_gives_the_same_bytes(tmp_path):
    one, two = save_body(some_body(), tmp_path / "one"), save_body(load_body(tmp_path / "one"), tmp_path / "two")
    assert one.read_bytes() == two.read_bytes()


def test_numpy_alone_reads_the_file(tmp_path):
    with np.load(save_body(some_body(), tmp_path / "b.ffr"), allow_pickle=False) as stored:
        np.testing.assert_array_equal(stored["omega2"], [1e4, 2e4, 3e4])
        assert json.loads(stored["meta"].tobytes())["name"] == "ünit"


@pytest.mark.slow
def test_no_flipped_byte_passes_unseen(tmp_path):
    """Every byte of the file is changed in turn: the file is refused, or the change was without meaning."""
    body = some_body(1)
    data = save_body(body, tmp_path / "b.ffr").read_bytes()
    refused = 0
    for position in range(0, len(data), 3):
        damaged = bytearray(data)
        damaged[position] ^= 0x55
        (tmp_path / "damaged").write_bytes(damaged)
        try:
            assert_same(body, load_body(tmp_path / "damaged"))
        except BodyError:
            refused += 1
    assert refused > len(data) // 6


def test_a_byte_flipped_in_the_middle_is_refused_in_words(tmp_path):
    data = bytearray(save_body(some_body(), tmp_path / "b.ffr").read_bytes())
    data[len(data) // 2] ^= 0xFF
    (tmp_path / "b.ffr").write_bytes(data)
    with pytest.raises(BodyError, match=r"b\.ffr is damaged, truncated or not a body file .* make it again"):
        load_body(tmp_path / "b.ffr")


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_a_truncated_file_is_refused(tmp_path, share):
    data = save_body(some_body(), tmp_path / "b.ffr").read_bytes()
    (tmp_path / "b.ffr").write_bytes(data[: int(share * len(data))])
    with pytest.raises(BodyError, match="damaged, truncated or not a body file"):
        load_body(tmp_path / "b.ffr")


def foreign_files():
    zipped, arrays, array, meta = io.BytesIO(), io.BytesIO(), io.BytesIO(), io.BytesIO()
    with zipfile.ZipFile(zipped, "w") as archive:
        archive.writestr("readme.txt", "hello")
    np.savez(arrays, x=np.zeros(3))
    np.save(array, np.zeros(3))
    np.savez(meta, meta=np.frombuffer(json.dumps({"magic": "other"}).encode(), np.uint8))
    unreadable = io.BytesIO()
    np.savez(unreadable, meta=np.frombuffer(b"{no json", np.uint8))
    return {
        "text": (b"node 1 0 0 0\n" * 9, "not a body file"),
        "zip": (zipped.getvalue(), "no header"),
        "npz": (arrays.getvalue(), "no header"),
        "npy": (array.getvalue(), "a bare array"),
        "foreign header": (meta.getvalue(), "foreign header"),
        "unreadable header": (unreadable.getvalue(), "not a body file"),
    }


@pytest.mark.parametrize("kind", foreign_files())
def test_a_foreign_file_is_refused(tmp_path, kind):
    data, words = foreign_files()[kind]
    (tmp_path / "file").write_bytes(data)
    with pytest.raises(BodyError, match=words):
        load_body(tmp_path / "file")


def rewritten(path, change):
    with np.load(path) as stored:
        arrays = {key: stored[key] for key in stored.files}
    meta = json.loads(arrays["meta"].tobytes())
    change(meta, arrays)
    arrays["meta"] = np.frombuffer(json.dumps(meta).encode(), np.uint8)
    with open(path, "wb") as stream:
        np.savez(stream, **arrays)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda meta, arrays: meta.update(format_version=99), "format 99; this program reads up to 4: update"),
        (lambda meta, arrays: arrays.pop("PP_dm"), "damaged.*'PP_dm'"),
        (lambda meta, arrays: meta.pop("name"), "damaged.*'name'"),
        (lambda meta, arrays: arrays.update(r_dm=np.zeros(4)), r"r_dm has shape \(4,\), not \(3,\)"),
        (lambda meta, arrays: meta.update(mass="heavy"), "damaged"),
        (lambda meta, arrays: meta.update(interfaces=3), "damaged"),
        (lambda meta, arrays: meta.update(format_version="new"), "damaged"),
    ],
)
def test_a_file_that_is_newer_or_inconsistent_is_refused(tmp_path, change, words):
    path = save_body(some_body(), tmp_path / "b.ffr")
    rewritten(path, change)
    with pytest.raises(BodyError, match=words):
        load_body(path)


def test_a_file_of_the_first_version_is_read(tmp_path):
    """It differs from the present one in nothing but what it cannot hold."""
    with np.load(save_body(some_body(), tmp_path / "b.ffr")) as stored:
        arrays = dict(stored)
    meta = json.loads(arrays["meta"].tobytes())
    assert meta["format_version"] == 2
    arrays["meta"] = np.frombuffer(json.dumps(meta | {"format_version": 1}).encode(), np.uint8)
    with open(tmp_path / "old.ffr", "wb") as stream:
        np.savez(stream, **arrays)
    assert_same(some_body(), load_body(tmp_path / "old.ffr"))


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(BodyError, match=r"nowhere\.ffr does not exist"):
        load_body(tmp_path / "nowhere.ffr")
    with pytest.raises(BodyError, match="cannot be read"):
        load_body(tmp_path)


def test_a_failed_write_leaves_the_existing_file(tmp_path, monkeypatch):
    path = save_body(some_body(), tmp_path / "b.ffr")
    before = path.read_bytes()

    def full_disk(stream, array, **options):
        stream.write(b"half a file")
        raise OSError("no space left on device")

    monkeypatch.setattr(body_file.np.lib.format, "write_array", full_disk)
    with pytest.raises(ComputationError, match="no space left"):
        save_body(some_body(2), path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["b.ffr"]


def test_provenance_must_be_json(tmp_path):
    body = replace(some_body(), provenance={"bad": object()})
    with pytest.raises(BodyError, match="provenance"):
        save_body(body, tmp_path / "b.ffr")
    assert list(tmp_path.iterdir()) == []


# ---- guards of the body -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"mass": -1.0}, "mass is -1.0 kg; it must be positive"),
        ({"mass": np.nan}, "must be positive"),
        ({"r_dm": np.zeros(2)}, r"r_dm has shape \(2,\), not \(3,\)"),
        ({"omega2": np.array([1.0, 2.0])}, "has shape"),
        ({"omega2": np.array([-1.0, 2.0, 3.0])}, "negative value -1"),
        ({"P_dm": np.full((3, 3), np.inf)}, "P_dm holds values that are not finite"),
        ({"rr_dm": np.diag([1.0, 1.0, -5.0])}, "no mass distribution has the principal moments"),
        ({"rr_dm": np.eye(3) + np.eye(3, k=1)}, "no mass distribution"),
    ],
)
def test_a_contradictory_body_is_refused(changes, words):
    with pytest.raises(BodyError, match=words):
        replace(some_body(), **changes)


def test_the_basis_must_be_orthonormal_and_its_integrals_symmetric():
    body = some_body()
    with pytest.raises(BodyError, match="not mass-orthonormal"):
        replace(body, PP_dm=1.001 * body.PP_dm)
    PP = body.PP_dm.copy()
    PP[0, 1, 0, 2] += 0.1
    with pytest.raises(BodyError, match=r"PP_dm\[l, k\] is not PP_dm\[k, l\]\^T"):
        replace(body, PP_dm=PP)


def test_interfaces_and_surface_must_fit():
    body = some_body()
    left = body.interfaces[0]
    with pytest.raises(BodyError, match="interface names repeat"):
        replace(body, interfaces=(left, left))
    with pytest.raises(BodyError, match="do not have 3 modes"):
        replace(body, interfaces=some_body(2).interfaces)
    with pytest.raises(BodyError, match="do not have 3 modes"):
        replace(body, surface=some_body(2).surface)
    with pytest.raises(BodyError, match="triangle refers to point 9, but there are 4 points"):
        replace(body.surface, triangles=[[0, 1, 9]])
    with pytest.raises(BodyError, match="has no interface 'top'; it has: 'left', 'right'"):
        body.interface("top")


def test_arrays_cannot_be_changed():
    body = some_body()
    with pytest.raises(ValueError, match="read-only"):
        body.r_dm[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        body.interfaces[0].phi_t[0, 0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        body.surface.triangles[0, 0] = 1


# ---- rigid and truncated ------------------------------------------------------------------------------------------


def test_a_rigid_body_has_the_inertia_it_was_given():
    inertia = np.array([[2.0, 0.1, 0.0], [0.1, 3.0, -0.2], [0.0, -0.2, 4.0]])
    body = rigid_body("r", mass=3.0, inertia=inertia, centre_of_mass=(1.0, 2.0, 3.0), points={"tip": (4.0, 5.0, 6.0)})
    np.testing.assert_allclose(body.central_inertia, inertia, atol=1e-12)
    np.testing.assert_allclose(body.centre_of_mass, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(body.inertia, inertia + 3.0 * (14.0 * np.eye(3) - np.outer([1, 2, 3], [1, 2, 3])))
    np.testing.assert_array_equal(body.interface("tip").position, [4.0, 5.0, 6.0])
    assert body.n == 0


def test_impossible_rigid_bodies_are_refused():
    with pytest.raises(BodyError, match="no mass distribution has the principal moments"):
        rigid_body("r", mass=1.0, inertia=(1.0, 1.0, 3.0))
    with pytest.raises(BodyError, match="must be positive"):
        rigid_body("r", mass=0.0, inertia=(1.0, 1.0, 1.0))
    with pytest.raises(BodyError, match=r"inertia must be \(3,\) or \(3, 3\)"):
        rigid_body("r", mass=1.0, inertia=(1.0, 1.0))


def test_truncation_keeps_the_chosen_modes():
    body = some_body()
    assert_same(truncated(body, 2), truncated(body, [0, 1]))
    one = truncated(body, [2])
    np.testing.assert_array_equal(one.omega2, body.omega2[2:])
    np.testing.assert_array_equal(one.PP_dm[..., 0, 0], body.PP_dm[..., 2, 2])
    np.testing.assert_array_equal(one.interfaces[1].phi_r[:, 0], body.interfaces[1].phi_r[:, 2])
    np.testing.assert_array_equal(one.surface.Phi[..., 0], body.surface.Phi[..., 2])
    assert truncated(body, 0).n == 0
    for wrong in ([0, 4], 4, [-1], [1, 1]):
        with pytest.raises(BodyError, match=r"has 3 modes(, counted from 0)?; asked to keep "):
            truncated(body, wrong)


def test_the_size_of_a_body_is_its_largest_extent():
    body = rigid_body("bar", mass=1.0, inertia=(1, 1, 1), points={"a": (0, 0, 0), "b": (1, -2, 0.5)})
    assert body.size == 2.0
    assert rigid_body("point", mass=1.0, inertia=(1, 1, 1)).size == 0.0
    surface = replace(some_body().surface, points=some_body().surface.points + np.array([9.0, 0, 0]))
    assert replace(some_body(), surface=surface).size > some_body().size

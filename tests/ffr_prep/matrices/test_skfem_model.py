"""scikit-fem's bases and matrices as a model: the same body as through the mesh, and guards."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from boxes import PLAIN, STEEL, box_mesh, shaken
from places import ROOT
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

from ffr_prep.body import FlexibleBody
from ffr_prep.common.errors import InputError
from ffr_prep.matrices.part import from_matrices
from ffr_prep.matrices.skfem_model import from_skfem
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import FixedTo
from ffr_prep.pipelines.reduce import Request, reduce
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.solids.assembly import MASS_ORDER, STIFFNESS_ORDER
from ffr_prep.solids.model import from_mesh

SIZE = (1.0, 0.2, 0.1)
ELEMENTS = {
    "tet4": (skfem.MeshTet, skfem.ElementTetP1),
    "tet10": (skfem.MeshTet, skfem.ElementTetP2),
    "hex8": (skfem.MeshHex, skfem.ElementHex1),
    "hex20": (skfem.MeshHex, skfem.ElementHexS2),
    "hex27": (skfem.MeshHex, skfem.ElementHex2),
}
SKFEM_HEX = [0, 4, 3, 1, 7, 5, 2, 6]  # VTK numbers of the corners of scikit-fem's hexahedron


def skfem_mesh(mesh, kind):
    """The straight elements of a mesh as a user of scikit-fem has them, ends named."""
    of_type, corners = ELEMENTS[kind][0], 4 if kind.startswith("tet") else 8
    used, numbers = np.unique(mesh.blocks[0].nodes[:, :corners], return_inverse=True)
    numbers = numbers.reshape(-1, corners)[:, SKFEM_HEX if corners == 8 else range(4)]
    theirs = of_type(mesh.points[used].T.copy(), numbers.T.copy())
    return theirs.with_boundaries({"left": lambda x: x[0] < 1e-9, "right": lambda x: x[0] > SIZE[0] - 1e-9})


def matrices(mesh, element, orders):
    basis, fine = (skfem.Basis(mesh, skfem.ElementVector(element), intorder=order) for order in orders)
    K = linear_elasticity(*lame_parameters(STEEL.E, STEEL.nu)).assemble(basis)
    return basis, K, skfem.BilinearForm(lambda u, v, w: STEEL.rho * dot(u, v)).assemble(fine)


def bar(element=None):
    mesh = skfem.MeshTet.init_tensor(*(np.linspace(0, of, 3) for of in SIZE)).with_defaults()
    return matrices(mesh, element or skfem.ElementTetP2(), (2, 4))


# With their points: the mean of the nodes is not the centroid of the area.
ENDS = [InterfaceRegion("left", point=(0, 0.1, 0.05)), InterfaceRegion("right", point=(1, 0.1, 0.05))]
REQUEST = Request(name="bar", reference=FixedTo("left"), reduction=CraigBampton(4))


def reduced(model) -> FlexibleBody:
    return reduce(from_matrices(model, ENDS), REQUEST)


# ---- the same body ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", PLAIN)
def test_the_body_is_that_of_the_mesh(kind):
    mesh = shaken(box_mesh(kind, SIZE, (3, 2, 2)), 0.005)
    basis, K, M = matrices(skfem_mesh(mesh, kind), ELEMENTS[kind][1](), (STIFFNESS_ORDER[kind], MASS_ORDER[kind]))
    found = reduced(from_skfem(basis, K, M))
    expected = reduce(from_mesh(mesh, STEEL, ENDS), REQUEST)
    np.testing.assert_allclose(found.omega2, expected.omega2, rtol=1e-10)
    assert found.mass == pytest.approx(expected.mass, rel=1e-13)
    np.testing.assert_allclose(found.rr_dm, expected.rr_dm, rtol=0, atol=1e-12 * expected.rr_dm.max())
    tips = [np.vstack([body.interfaces[1].phi_t, 0.1 * body.interfaces[1].phi_r]) for body in (found, expected)]
    signs = np.sign(np.sum(tips[0] * tips[1], axis=0))
    for one, other in (
        (found.P_dm, expected.P_dm),
        (found.rP_dm, expected.rP_dm),
        (found.interfaces[1].phi_t, expected.interfaces[1].phi_t),
        (found.interfaces[1].phi_r, expected.interfaces[1].phi_r),
    ):
        np.testing.assert_allclose(one * signs, other, rtol=0, atol=1e-9 * np.abs(other).max())
    PP = found.PP_dm * signs[:, None] * signs
    np.testing.assert_allclose(PP, expected.PP_dm, rtol=0, atol=1e-9)


@pytest.mark.parametrize("kind", PLAIN)
def test_the_surface_is_that_of_the_mesh_seen_from_outside(kind):
    mesh = shaken(box_mesh(kind, SIZE, (3, 2, 2)), 0.005)
    basis, K, M = matrices(skfem_mesh(mesh, kind), ELEMENTS[kind][1](), (2, 2))
    model = from_skfem(basis, K, M)
    a, b, c = np.moveaxis(model.points[model.triangles], 1, 0)
    assert np.einsum("tk,tk->", a, np.cross(b, c)) / 6 == pytest.approx(np.prod(SIZE), rel=0.01)
    body = reduced(from_skfem(*matrices(skfem_mesh(mesh, kind), ELEMENTS[kind][1](), (STIFFNESS_ORDER[kind], 9))))
    assert len(body.surface.triangles) == len(model.triangles)


def test_a_curved_mesh_keeps_its_shape():
    ball = skfem.MeshTet2.init_ball(2)
    basis, K, M = matrices(ball.with_boundaries({"cap": lambda x: x[2] > 0.7}), skfem.ElementTetP2(), (4, 7))
    model = from_skfem(basis, K, M)
    on_sphere = np.linalg.norm(model.points[np.unique(model.triangles)], axis=1)
    np.testing.assert_allclose(on_sphere, 1.0, atol=1e-12)
    assert len(model.groups["cap"]) > 3


def test_regions_by_subdomain_and_by_degrees_of_freedom():
    mesh = skfem.MeshHex.init_tensor(*(np.linspace(0, of, 5) for of in SIZE))
    mesh = mesh.with_subdomains({"left": lambda x: x[0] < 0.5})
    basis, K, M = matrices(mesh, skfem.ElementHex1(), (3, 3))
    model = from_skfem(basis, K, M, regions={"right": basis.get_dofs(lambda x: x[0] > 1 - 1e-9)})
    assert model.points[model.groups["left"]][:, 0].max() == pytest.approx(0.5)
    assert len(model.groups["left"]) == 75
    np.testing.assert_array_equal(model.points[model.groups["right"]][:, 0], 1.0)
    assert reduced(model).n == 10


# ---- guards -------------------------------------------------------------------------------------------------------


def test_a_scalar_basis_is_refused():
    basis = skfem.Basis(skfem.MeshTet(), skfem.ElementTetP1())
    with pytest.raises(InputError, match=r"of ElementTetP1; displacements need a vector"):
        from_skfem(basis, np.eye(8), np.eye(8))


def test_a_plane_basis_is_refused():
    basis = skfem.Basis(skfem.MeshTri(), skfem.ElementVector(skfem.ElementTriP1()))
    with pytest.raises(InputError, match="2 components on a mesh of 2 dimensions"):
        from_skfem(basis, np.eye(8), np.eye(8))


def test_degrees_of_freedom_that_are_no_displacements_are_refused():
    basis, K, M = bar(skfem.ElementTetMini())
    with pytest.raises(InputError, match="ElementTetMini are not displacements"):
        from_skfem(basis, K, M)


def test_matrices_of_another_size_are_refused():
    basis, K, M = bar()
    with pytest.raises(InputError, match=rf"K has the shape \(3, 3\), but the basis has {basis.N}"):
        from_skfem(basis, K[:3, :3], M)
    with pytest.raises(InputError, match="M has the shape"):
        from_skfem(basis, K, M[:-1])


def test_a_matrix_that_is_not_symmetric_is_refused():
    basis, K, M = bar()
    K = K.tolil()
    K[0, 1] += abs(K[0, 0])
    with pytest.raises(InputError, match="K is not symmetric: its entries for translation along x of node 1"):
        from_skfem(basis, K.tocsr(), M)


def test_a_part_of_a_mesh_is_refused():
    mesh = skfem.MeshTet()
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTetP1()), elements=[0, 1])
    with pytest.raises(InputError, match="all elements of the mesh"):
        from_skfem(basis, np.eye(basis.N), np.eye(basis.N))


def test_regions_are_degrees_of_freedom_with_names_of_their_own():
    basis, K, M = bar()
    with pytest.raises(InputError, match="region 'left' is there twice"):
        from_skfem(basis, K, M, regions={"left": basis.get_dofs("right")})
    with pytest.raises(InputError, match="region 'tip' must be degrees of freedom"):
        from_skfem(basis, K, M, regions={"tip": [basis.N]})


def test_matrices_of_a_held_body_are_refused():
    basis, K, M = bar()
    held = np.zeros(basis.N)
    held[basis.get_dofs("left").flatten()] = abs(K).max()
    K = K + sp.diags_array(held)
    with pytest.raises(InputError, match="rigid"):
        reduced(from_skfem(basis, K, M))


def test_the_example_of_the_documentation():
    page = (ROOT / "docs" / "matrices.md").read_text(encoding="utf-8").partition("## scikit-fem")[2]
    space: dict = {}
    exec(compile(page.split("```python\n")[1].split("```")[0], "matrices.md", "exec"), space)
    assert {"left", "right", "edge"} <= space["matrices"].groups.keys()

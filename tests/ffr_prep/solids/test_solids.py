"""Stiffness and mass of solids: laws, an independent assembly, closed forms, guards."""

from dataclasses import replace

import gmsh
import numpy as np
import pytest
import skfem
from boxes import KINDS, PLAIN, STEEL, box_inertia, box_mesh, moved, rigid_motions, rotation, shaken
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

from ffr_prep.common.errors import InputError
from ffr_prep.mesh.mesh import Block, Mesh
from ffr_prep.mesh.shapes import face_mass
from ffr_prep.model.invariants import inertia_integrals
from ffr_prep.model.material import Material
from ffr_prep.solids.assembly import MASS_ORDER, STIFFNESS_ORDER, assemble, vector_mass

SIZE = np.array([2.0, 0.3, 0.2])
ELEMENTS = {
    "tet4": (skfem.MeshTet, skfem.ElementTetP1, 4),
    "tet10": (skfem.MeshTet, skfem.ElementTetP2, 4),
    "hex8": (skfem.MeshHex, skfem.ElementHex1, 8),
    "hex20": (skfem.MeshHex, skfem.ElementHexS2, 8),
    "hex27": (skfem.MeshHex, skfem.ElementHex2, 8),
}
# VTK numbers of the corners of scikit-fem's hexahedron.
SKFEM_HEX = [0, 4, 3, 1, 7, 5, 2, 6]


def bent(points):
    x, y, z = points.T
    return np.column_stack([x + 0.2 * y * z, y + 0.05 * x**2, z + 0.1 * np.sin(x)])


# ---- laws ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_rigid_motions_cost_no_energy_and_nothing_else_does(kind):
    mesh = box_mesh(kind, (1.0, 0.5, 0.7), (1, 2, 1), mapped=bent)
    K = assemble(mesh, STEEL).K
    T = rigid_motions(mesh.points).reshape(-1, 6)
    assert np.abs(K @ T).max() < 1e-13 * np.abs(K.data).max()
    energies = np.linalg.eigvalsh(K.toarray())
    assert energies[5] < 1e-12 * energies[-1]
    assert energies[6] > 1e-5 * energies[-1]


@pytest.mark.parametrize("kind", KINDS)
def test_matrices_are_symmetric_and_the_mass_is_positive(kind):
    matrices = assemble(box_mesh(kind, (1.0, 0.5, 0.7), (1, 2, 1), mapped=bent), STEEL)
    assert abs(matrices.K - matrices.K.T).max() <= 1e-14 * np.abs(matrices.K.data).max()
    assert abs(matrices.m - matrices.m.T).max() <= 1e-14 * np.abs(matrices.m.data).max()
    assert np.linalg.eigvalsh(matrices.m.toarray())[0] > 0


@pytest.mark.parametrize("kind", KINDS)
def test_a_linear_displacement_has_the_energy_of_its_strain(kind):
    mesh = shaken(box_mesh(kind, tuple(SIZE), (2, 2, 2)), 0.02)
    gradient = np.random.default_rng(3).normal(size=(3, 3))
    strain = (gradient + gradient.T) / 2
    lam, mu = lame_parameters(STEEL.E, STEEL.nu)
    expected = SIZE.prod() * (lam * np.trace(strain) ** 2 / 2 + mu * np.sum(strain**2))
    u = (mesh.points @ gradient.T).ravel()
    assert u @ (assemble(mesh, STEEL).K @ u) / 2 == pytest.approx(expected, rel=1e-12)


def test_vector_mass_repeats_the_scalar_mass():
    matrices = assemble(box_mesh("hex8", (1.0, 1.0, 1.0), (1, 1, 1)), STEEL)
    np.testing.assert_array_equal(vector_mass(matrices.m).toarray(), np.kron(matrices.m.toarray(), np.eye(3)))


@pytest.mark.parametrize("kind", KINDS)
def test_face_mass_measures_the_area_and_its_first_moment(kind):
    mesh = moved(box_mesh(kind, tuple(SIZE), (2, 2, 2)), rotation(1), np.array([3.0, -1.0, 2.0]))
    (faces,) = mesh.face_groups["right"]
    weights = face_mass(mesh.points, faces)
    assert weights.sum() == pytest.approx(SIZE[1] * SIZE[2], rel=1e-13)
    centroid = np.einsum("fab,fbc->c", weights, mesh.points[faces]) / weights.sum()
    expected = rotation(1) @ (SIZE * [1, 0.5, 0.5]) + [3.0, -1.0, 2.0]
    np.testing.assert_allclose(centroid, expected, rtol=1e-13)


# ---- an independent assembly --------------------------------------------------------------------------------------


def scikit_fem_basis(mesh, kind, order):
    """scikit-fem's own vector basis on the same straight mesh, and for each of its dofs our 3*node + component."""
    mesh_type, element, corners = ELEMENTS[kind]
    used, connectivity = np.unique(mesh.blocks[0].nodes[:, :corners], return_inverse=True)
    connectivity = connectivity.reshape(-1, corners)[:, SKFEM_HEX if corners == 8 else range(4)]
    theirs = mesh_type(mesh.points[used].T.copy(), connectivity.T.copy())
    basis = skfem.Basis(theirs, skfem.ElementVector(element()), intorder=order)
    distance = np.linalg.norm(basis.doflocs.T[:, None] - mesh.points[None], axis=-1)
    assert distance.min(axis=1).max() < 1e-12
    component = np.zeros(basis.N, int)
    for dofs in (basis.nodal_dofs, basis.edge_dofs, basis.facet_dofs, basis.interior_dofs):
        if dofs.size:
            component[dofs] = np.arange(3)[:, None]
    return basis, 3 * distance.argmin(axis=1) + component


@pytest.mark.parametrize("kind", PLAIN)
def test_matrices_equal_those_of_scikit_fem(kind):
    mesh = shaken(box_mesh(kind, tuple(SIZE), (2, 2, 2)), 0.02)
    matrices = assemble(mesh, STEEL)
    basis, ours = scikit_fem_basis(mesh, kind, STIFFNESS_ORDER[kind])
    K = linear_elasticity(*lame_parameters(STEEL.E, STEEL.nu)).assemble(basis).toarray()
    assert sorted(ours) == list(range(3 * len(mesh.points)))
    np.testing.assert_allclose(matrices.K.toarray()[np.ix_(ours, ours)], K, rtol=0, atol=1e-12 * np.abs(K).max())

    basis, ours = scikit_fem_basis(mesh, kind, MASS_ORDER[kind])
    M = skfem.BilinearForm(lambda u, v, w: STEEL.rho * dot(u, v)).assemble(basis).toarray()
    mine = vector_mass(matrices.m).toarray()
    np.testing.assert_allclose(mine[np.ix_(ours, ours)], M, rtol=0, atol=1e-12 * np.abs(M).max())


# ---- closed forms -------------------------------------------------------------------------------------------------


def assert_inertia_of_box(mesh, R, centre, rel):
    m = assemble(mesh, STEEL).m
    found = inertia_integrals(mesh.points, m, np.zeros((len(mesh.points), 3, 0)))
    mass = STEEL.rho * SIZE.prod()
    central = R @ box_inertia(mass, SIZE) @ R.T
    about_origin = central + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    assert found.mass == pytest.approx(mass, rel=rel)
    np.testing.assert_allclose(found.r_dm, mass * centre, rtol=0, atol=rel * mass * np.linalg.norm(centre))
    inertia = np.trace(found.rr_dm) * np.eye(3) - found.rr_dm
    np.testing.assert_allclose(inertia, about_origin, rtol=0, atol=rel * np.abs(about_origin).max())


@pytest.mark.parametrize("kind", KINDS)
def test_inertia_of_a_turned_and_distorted_box(kind):
    R, by = rotation(5), np.array([0.4, -1.2, 2.0])
    amplitude = 0.01 if kind.startswith("pyramid") else 0.03  # six to a cell are flat
    mesh = moved(shaken(box_mesh(kind, tuple(SIZE), (4, 3, 3)), amplitude), R, by)
    assert_inertia_of_box(mesh, R, R @ SIZE / 2 + by, 1e-12)


def gmsh_box(size, target):
    """Second-order tetrahedra of gmsh; its last two mid-edge nodes are exchanged against VTK's."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.option.setNumber("Mesh.MeshSizeMax", target)
        gmsh.model.occ.addBox(0, 0, 0, *size)
        gmsh.model.occ.synchronize()
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        _, _, nodes = gmsh.model.mesh.getElements(3)
    finally:
        gmsh.finalize()
    order = np.argsort(tags)
    connectivity = np.searchsorted(tags[order], nodes[0]).reshape(-1, 10)[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]
    block = Block("tet10", connectivity.astype(np.int64))
    return Mesh(coordinates.reshape(-1, 3)[order], (block,), {}, {}, {})


def test_inertia_of_a_turned_box_meshed_by_gmsh():
    R, by = rotation(6), np.array([-0.3, 0.2, 1.0])
    mesh = moved(gmsh_box(SIZE, 0.12), R, by)
    assert len(mesh.blocks[0].nodes) > 300
    assert_inertia_of_box(mesh, R, R @ SIZE / 2 + by, 1e-12)


def test_mass_of_curved_elements_is_the_integral_over_their_shape():
    # x -> x + 0.2 y z has unit Jacobian, so the volume stays and hex27 holds the shape exactly.
    mesh = box_mesh("hex27", tuple(SIZE), (2, 1, 1), mapped=lambda p: p + np.outer(p[:, 1] * p[:, 2], [0.2, 0, 0]))
    found = inertia_integrals(mesh.points, assemble(mesh, STEEL).m, np.zeros((len(mesh.points), 3, 0)))
    a, b, c = SIZE
    assert found.mass == pytest.approx(STEEL.rho * a * b * c, rel=1e-13)
    assert found.r_dm[0] == pytest.approx(STEEL.rho * a * b * c * (a / 2 + 0.2 * b * c / 4), rel=1e-13)
    second = a**2 / 3 + 2 * 0.2 * (a / 2) * (b * c / 4) + 0.04 * b**2 * c**2 / 9
    assert found.rr_dm[0, 0] == pytest.approx(STEEL.rho * a * b * c * second, rel=1e-13)


# ---- materials and guards -----------------------------------------------------------------------------------------


def test_materials_by_volume_group():
    mesh = box_mesh("hex8", (2.0, 1.0, 1.0), (2, 1, 1))
    mesh = replace(mesh, volume_groups={"one": np.array([0]), "two": np.array([1])})
    light = Material(name="light", E=7e10, nu=0.33, rho=2700.0)
    matrices = assemble(mesh, {"one": STEEL, "two": light})
    assert matrices.m.sum() == pytest.approx(7850.0 + 2700.0, rel=1e-13)
    parts = [replace(mesh, blocks=(Block("hex8", mesh.blocks[0].nodes[[k]]),)) for k in range(2)]
    K = assemble(parts[0], STEEL).K + assemble(parts[1], light).K
    np.testing.assert_allclose(matrices.K.toarray(), K.toarray(), rtol=0, atol=1e-4)


def test_blocks_of_different_kinds_share_one_pattern():
    one, two = box_mesh("hex8", (1.0, 1.0, 1.0), (1, 1, 1)), box_mesh("tet4", (1.0, 1.0, 1.0), (1, 1, 1))
    both = replace(one, blocks=(one.blocks[0], two.blocks[0]))
    K = assemble(one, STEEL).K.toarray() + assemble(two, STEEL).K.toarray()
    np.testing.assert_allclose(assemble(both, STEEL).K.toarray(), K, rtol=0, atol=1e-4)


@pytest.mark.parametrize(
    ("groups", "materials", "words"),
    [
        ({"one": [0]}, {"one": STEEL}, "element 1 has 0 materials"),
        ({"one": [0, 1], "two": [1]}, {"one": STEEL, "two": STEEL}, "element 1 has 2 materials"),
        ({"one": [0, 1]}, {"other": STEEL}, "'other'; the mesh has 'one'"),
    ],
)
def test_every_element_needs_one_material(groups, materials, words):
    mesh = box_mesh("hex8", (2.0, 1.0, 1.0), (2, 1, 1))
    mesh = replace(mesh, volume_groups={name: np.array(elements) for name, elements in groups.items()})
    with pytest.raises(InputError, match=words):
        assemble(mesh, materials)


@pytest.mark.parametrize("kind", KINDS)
def test_an_element_turned_inside_out_is_named(kind):
    mesh = box_mesh(kind, (1.0, 1.0, 1.0), (2, 1, 1), mapped=lambda p: p * [1, 1, -1])
    with pytest.raises(InputError, match=rf"element \d+ \({kind}.*inside out"):
        assemble(mesh, STEEL)

"""From a mesh to a reduced flexible body in the floating frame of reference: the front door.

    import ffr_prep as fp

    mesh = fp.read_mesh("rod.geo", unit="mm")
    model = fp.from_mesh(mesh, fp.material("steel"), [fp.InterfaceRegion("big_eye"), fp.InterfaceRegion("small_eye")])
    body = fp.reduce(model, fp.Request(
        name="rod", reference=fp.SimplySupported("big_eye", "small_eye"), reduction=fp.CraigBampton(10)))
    fp.save_body(body, "rod.ffr")

A *model* is a finite-element model with its interfaces, of whatever kind: `from_mesh` makes it of solids, `from_frame` of
beams and plates, `from_matrices` of the K and M of another program, `tied` of several models, `read_structure` of a text
file. `reduce(model, request)` makes a *body* of it. A `Request` says how: reference conditions (`FixedTo`,
`SimplySupported`, `MeanAxis`, `Supports`, `UserConditions`) attach the body's frame, a reduction (`CraigBampton`, `Rubin`,
`Eigenmodes`, `Guyan`, `CharacteristicModes`, `Krylov`, `AttachmentModes`, `InertiaRelief`, `UserVectors`, or a `Union`)
chooses its shapes; a number, `UpTo` or `Accuracy` says how many modes. Bodies are immutable: `truncated`, `with_point`,
`with_reference` return others.

`faces` tells what surfaces a part has; `InterfaceRegion("pin", "cylinder r=6mm at 0,0,0")` finds one by what it is, and
`found_faces` names its faces; `face_picture` and `face_page` show them; `region_triangles` finds the triangles of a body's
surface on which a pressure acts. `rigid_part` makes a rigid body of a geometry.

`register_reduction`, `register_mesh_format`, `register_matrix_format` and `register_exchange_format` add to what command
line and files offer (CONTRIBUTING.md shows how). `dir(ffr_prep)` lists all names; `help(ffr_prep.reduce)` and the like
explain them. Each is loaded when it is first used, with what it needs. What is not listed here is private: the modules of
this package may change at any time. Quantities are in SI units; what cannot be used raises `InputError`, what cannot be
computed `ComputationError`.
"""

from typing import TYPE_CHECKING

from ffr_prep.common.front_door import front_door

# No name here is that of a room, whose import would put the room in its place.
_BY_MODULE = {
    "ffr_prep.body": "BeamForces BodyError Damping FlexibleBody FrameMarker Interface MeanAxisForm Surface damped immovable "
    "load_body mean_axis_form rigid_body save_body truncated units_doubts with_point",
    "ffr_prep.common.errors": "ComputationError InputError",
    "ffr_prep.common.registry": "Setting",
    "ffr_prep.interchange.formats": "register_exchange_format ExchangeFormat",
    "ffr_prep.interchange.mbdyn": "read_fem write_fem",
    "ffr_prep.interchange.sid": "read_sid write_sid",
    "ffr_prep.matrices.formats": "register_matrix_format MatrixFormat",
    "ffr_prep.matrices.model": "MatrixModel with_group with_node with_surface",
    "ffr_prep.matrices.npz": "save_matrices",
    "ffr_prep.matrices.part": "from_matrices",
    "ffr_prep.matrices.readers": "read_matrices",
    "ffr_prep.matrices.skfem_model": "from_skfem",
    "ffr_prep.mesh.geometry.face_files": "faces found_faces",
    "ffr_prep.mesh.geometry.face": "Face",
    "ffr_prep.mesh.geometry.faces": "Faces",
    "ffr_prep.mesh.file_mesh": "FileMesh",
    "ffr_prep.mesh.formats": "register_mesh_format MeshFormat",
    "ffr_prep.mesh.mesh": "Block Mesh check_mesh read_mesh",
    "ffr_prep.model.coupled": "InterfaceRegion",
    "ffr_prep.model.cuts": "CutPlane",
    "ffr_prep.model.material": "AnisotropicMaterial Material material orthotropic",
    "ffr_prep.model.model": "Model",
    "ffr_prep.model.reference": "FixedTo MeanAxis SimplySupported Support Supports UserConditions",
    "ffr_prep.pipelines.file_materials": "file_materials",
    "ffr_prep.pipelines.reduce": "Request reduce",
    "ffr_prep.pipelines.rigid": "rigid_part",
    "ffr_prep.pipelines.structure_file": "Structure read_structure",
    "ffr_prep.pipelines.tied": "tied",
    "ffr_prep.reduction.basis": "Basis Reduction basis_of",
    "ffr_prep.reduction.conversion": "with_reference",
    "ffr_prep.reduction.methods.attachment": "AttachmentModes",
    "ffr_prep.reduction.methods.characteristic": "CharacteristicModes",
    "ffr_prep.reduction.methods.craig_bampton": "CraigBampton",
    "ffr_prep.reduction.methods.eigenmodes": "Eigenmodes",
    "ffr_prep.reduction.methods.guyan": "Guyan",
    "ffr_prep.reduction.methods.inertia_relief": "InertiaRelief",
    "ffr_prep.reduction.methods.krylov": "Krylov",
    "ffr_prep.reduction.methods.rubin": "Rubin",
    "ffr_prep.reduction.methods.union": "Union",
    "ffr_prep.reduction.methods.user_vectors": "UserVectors",
    "ffr_prep.reduction.quality": "Quality quality_of",
    "ffr_prep.reduction.registry": "register_reduction ReductionMethod",
    "ffr_prep.reduction.selection": "Accuracy Band UpTo",
    "ffr_prep.report.face_page": "face_page",
    "ffr_prep.report.faces": "face_picture",
    "ffr_prep.report.mode_pictures": "mode_pictures",
    "ffr_prep.report.quality_pictures": "quality_pictures",
    "ffr_prep.solids.model": "from_mesh",
    "ffr_prep.solids.surface_regions": "region_triangles",
    "ffr_prep.solvers.factor": "Solver",
    "ffr_prep.structures.frame": "Frame Member Shell joined named panel polyline triangulated",
    "ffr_prep.structures.frame_geometry": "read_frame",
    "ffr_prep.structures.model": "from_frame",
    "ffr_prep.structures.nodal_integrals": "NodalIntegrals nodal_integrals",
    "ffr_prep.structures.sections": "Section box circle general i_section rectangle shear_rigid shifted tube "
    "with_mass_moments",
}
__all__, __getattr__, __dir__ = front_door(__name__, _BY_MODULE)

if TYPE_CHECKING:  # the same names, for editors and checkers of types
    # fmt: off
    # isort: off
    __version__: str
    from ffr_prep.body import (
        BeamForces as BeamForces, BodyError as BodyError, Damping as Damping, FlexibleBody as FlexibleBody,
        FrameMarker as FrameMarker,
        Interface as Interface, MeanAxisForm as MeanAxisForm, Surface as Surface, damped as damped, immovable as immovable,
        load_body as load_body,
        mean_axis_form as mean_axis_form, rigid_body as rigid_body, save_body as save_body, truncated as truncated,
        units_doubts as units_doubts, with_point as with_point,
    )
    from ffr_prep.common.errors import ComputationError as ComputationError, InputError as InputError
    from ffr_prep.common.registry import Setting as Setting
    from ffr_prep.interchange.formats import (
        register_exchange_format as register_exchange_format, ExchangeFormat as ExchangeFormat,
    )
    from ffr_prep.interchange.mbdyn import read_fem as read_fem, write_fem as write_fem
    from ffr_prep.interchange.sid import read_sid as read_sid, write_sid as write_sid
    from ffr_prep.matrices.formats import register_matrix_format as register_matrix_format, MatrixFormat as MatrixFormat
    from ffr_prep.matrices.model import (
        MatrixModel as MatrixModel, with_group as with_group, with_node as with_node,
        with_surface as with_surface,
    )
    from ffr_prep.matrices.npz import save_matrices as save_matrices
    from ffr_prep.matrices.part import from_matrices as from_matrices
    from ffr_prep.matrices.readers import read_matrices as read_matrices
    from ffr_prep.matrices.skfem_model import from_skfem as from_skfem
    from ffr_prep.mesh.geometry.face_files import faces as faces, found_faces as found_faces
    from ffr_prep.mesh.geometry.face import Face as Face
    from ffr_prep.mesh.geometry.faces import Faces as Faces
    from ffr_prep.mesh.file_mesh import FileMesh as FileMesh
    from ffr_prep.mesh.formats import register_mesh_format as register_mesh_format, MeshFormat as MeshFormat
    from ffr_prep.mesh.mesh import Block as Block, Mesh as Mesh, check_mesh as check_mesh, read_mesh as read_mesh
    from ffr_prep.model.coupled import InterfaceRegion as InterfaceRegion
    from ffr_prep.model.cuts import CutPlane as CutPlane
    from ffr_prep.model.material import (
        AnisotropicMaterial as AnisotropicMaterial, Material as Material, material as material,
        orthotropic as orthotropic,
    )
    from ffr_prep.model.model import Model as Model
    from ffr_prep.model.reference import (
        FixedTo as FixedTo, MeanAxis as MeanAxis, SimplySupported as SimplySupported, Support as Support,
        Supports as Supports, UserConditions as UserConditions,
    )
    from ffr_prep.pipelines.file_materials import file_materials as file_materials
    from ffr_prep.pipelines.reduce import Request as Request, reduce as reduce
    from ffr_prep.pipelines.rigid import rigid_part as rigid_part
    from ffr_prep.pipelines.structure_file import Structure as Structure, read_structure as read_structure
    from ffr_prep.pipelines.tied import tied as tied
    from ffr_prep.reduction.basis import Basis as Basis, Reduction as Reduction, basis_of as basis_of
    from ffr_prep.reduction.conversion import with_reference as with_reference
    from ffr_prep.reduction.methods.attachment import AttachmentModes as AttachmentModes
    from ffr_prep.reduction.methods.characteristic import CharacteristicModes as CharacteristicModes
    from ffr_prep.reduction.methods.craig_bampton import CraigBampton as CraigBampton
    from ffr_prep.reduction.methods.eigenmodes import Eigenmodes as Eigenmodes
    from ffr_prep.reduction.methods.guyan import Guyan as Guyan
    from ffr_prep.reduction.methods.inertia_relief import InertiaRelief as InertiaRelief
    from ffr_prep.reduction.methods.krylov import Krylov as Krylov
    from ffr_prep.reduction.methods.rubin import Rubin as Rubin
    from ffr_prep.reduction.methods.union import Union as Union
    from ffr_prep.reduction.methods.user_vectors import UserVectors as UserVectors
    from ffr_prep.reduction.quality import Quality as Quality, quality_of as quality_of
    from ffr_prep.reduction.registry import register_reduction as register_reduction, ReductionMethod as ReductionMethod
    from ffr_prep.reduction.selection import Accuracy as Accuracy, Band as Band, UpTo as UpTo
    from ffr_prep.report.face_page import face_page as face_page
    from ffr_prep.report.faces import face_picture as face_picture
    from ffr_prep.report.mode_pictures import mode_pictures as mode_pictures
    from ffr_prep.report.quality_pictures import quality_pictures as quality_pictures
    from ffr_prep.solids.model import from_mesh as from_mesh
    from ffr_prep.solids.surface_regions import region_triangles as region_triangles
    from ffr_prep.solvers.factor import Solver as Solver
    from ffr_prep.structures.frame import (
        Frame as Frame, Member as Member, Shell as Shell, joined as joined, named as named, panel as panel,
        polyline as polyline, triangulated as triangulated,
    )
    from ffr_prep.structures.frame_geometry import read_frame as read_frame
    from ffr_prep.structures.model import from_frame as from_frame
    from ffr_prep.structures.nodal_integrals import NodalIntegrals as NodalIntegrals, nodal_integrals as nodal_integrals
    from ffr_prep.structures.sections import (
        Section as Section, box as box, circle as circle, general as general, i_section as i_section,
        rectangle as rectangle, shear_rigid as shear_rigid, shifted as shifted, tube as tube,
        with_mass_moments as with_mass_moments,
    )

"""Flexible multibody dynamics in the floating frame of reference: from reduced bodies to a moving machine.

    import ffr_dyn as fd

    rod = fd.load_body("rod.ffr")  # from `ffr_prep`; or fd.rigid_body("rod", mass=..., inertia=..., points=...)
    hinge = fd.Joint("hinge", "revolute", "ground.wall", "rod.hinge", axis=(0, 0, 1))
    scene = fd.Scene((fd.Body("rod", rod),), (hinge,), ground={"wall": (0, 0, 0)}, gravity=(0, -9.81, 0))
    result = fd.forward(scene, end=2.0, output_step=0.01, method=fd.ROS2(1e-3))
    result["rod.tip.position"]  # (rows, 3) [m]; print(result) says what there is
    fd.plot(result, ["rod.tip.position", "hinge.force"], "pendulum.png")

A *scene* is declared: bodies, joints, drivers, couplings, forces, measurements, each with its own name; points are
named "body.interface" or "ground.point". An *analysis* is a function of a scene that returns a `Result`: `assemble`,
`kinematic`, `static`, `steady`, `forward`, `periodic`, `inverse`, `mixed`, `linearise`, `campbell`, `response`, `forced`,
`reference`. Integrators, functions of time and pictures are functions and small declarations beside them. All
quantities are in SI units. What cannot be used raises `InputError`, which says what to change; what could not be
computed raises `ComputationError`.

Everything a user needs is here, in `ffr_dyn.__all__`, and is loaded when it is first asked for. The modules below this one
are private: they move and change without notice.
"""

from typing import TYPE_CHECKING

from ffr_prep.common.front_door import front_door

# No name here is that of a room, whose import would put the room in its place.
_BY_MODULE = {
    "ffr_prep.body": "FlexibleBody load_body rigid_body save_body truncated with_point",
    "ffr_prep.common.errors": "ComputationError InputError",
    "ffr_prep.common.registry": "load_plugin",
    "ffr_dyn.functions.curves": "Curve",
    "ffr_dyn.functions.formula": "formula",
    "ffr_dyn.functions.time_functions": "TimeFunction constant harmonic piecewise polynomial signal table user",
    "ffr_dyn.scene.couplings": "Coupling",
    "ffr_dyn.scene.drivers": "Driver PointDriver",
    "ffr_dyn.scene.forces": "Actuator Bushing JointFriction JointSpring JointStop Load ModalForce NodalForces Pressure Servo "
    "SpringDamper",
    "ffr_dyn.scene.force_kinds": "register_force",
    "ffr_dyn.scene.forces.force": "Force",
    "ffr_dyn.scene.forces.places": "AlongLine AtMarker BetweenAxes OnBody OnJoint",
    "ffr_dyn.scene.joints": "Joint register_joint",
    "ffr_dyn.scene.scene": "Body Scene",
    "ffr_dyn.scene.sensors": "Measurement SectionMeasurement StressMeasurement",
    "ffr_dyn.variants.variant": "vary with_modes without_terms",
    "ffr_dyn.integrators": "AdaptiveROS3 DormandPrince GeneralisedAlpha HHT HalfExplicit Integrator RK4 ROS2 ROS3 Tolerances "
    "Variational Within register_integrator tolerances",
    "ffr_dyn.integrators.stabilisation": "Baumgarte Drifting Projection",
    "ffr_dyn.compile.first_use": "begin_compiling",
    "ffr_dyn.results.file": "load_result save_result",
    "ffr_dyn.results.result": "Axis Quantity Result write_csv",
    "ffr_dyn.results.stress_error": "stress_error",
    "ffr_dyn.results.stress": "hot_spots peaks section_forces section_histories section_peaks stress_histories",
    "ffr_dyn.consistency.assemble": "Assembled assemble",
    "ffr_dyn.consistency.mobility": "Mobility mobility",
    "ffr_dyn.consistency.validity": "in_enough_parts parts_needed",
    "ffr_dyn.pictures.animate": "animate",
    "ffr_dyn.pictures.export": "export",
    "ffr_dyn.pictures.histories": "plot plot_path",
    "ffr_dyn.pictures.scene_view": "show",
    "ffr_dyn.pictures.viewer": "Viewer",
    "ffr_dyn.pictures.stress_report": "report_lines stress_report",
    "ffr_dyn.analyses.batch": "forward_many",
    "ffr_dyn.analyses.inversion.bounded": "Bounded",
    "ffr_dyn.analyses.efforts": "JointEffort MarkerEffort recorded with_effort",
    "ffr_dyn.analyses.events": "Event",
    "ffr_dyn.analyses.forward": "Forward forward",
    "ffr_dyn.analyses.inverse": "Dynamic Inverse QuasiStatic inverse",
    "ffr_dyn.analyses.kinematic": "Kinematic kinematic",
    "ffr_dyn.analyses.linearise": "Linearisation Linearise linearise",
    "ffr_dyn.analyses.rotating.mode_motion": "mode_motion",
    "ffr_dyn.analyses.mixed": "Causal Mixed mixed",
    "ffr_dyn.analyses.reference": "IDA SciPy reference",
    "ffr_dyn.analyses.registry": "OfMoment OverTime option register_analysis",
    "ffr_dyn.pictures.bode": "draw_bode draw_nyquist",
    "ffr_dyn.pictures.campbell": "draw_campbell",
    "ffr_dyn.analyses.rotating.campbell": "Campbell campbell",
    "ffr_dyn.analyses.rotating.periodic": "Periodic floquet_motion periodic",
    "ffr_dyn.analyses.rotating.response": "Response response",
    "ffr_dyn.analyses.rotating.forced": "Forced forced",
    "ffr_dyn.pictures.forced": "draw_forced",
    "ffr_dyn.analyses.rotating.steady": "Steady steady",
    "ffr_dyn.analyses.run": "run",
    "ffr_dyn.analyses.settings": "Charted MomentSettings Settings",
    "ffr_dyn.analyses.assemble": "Assemble assembly",
    "ffr_dyn.analyses.states": "held scene_at",
    "ffr_dyn.analyses.static": "Static static",
    "ffr_dyn.realtime.deadline": "Timing measure_steps",
    "ffr_dyn.realtime.stepper": "Stepper",
    "ffr_dyn.scene_file.read": "load_scene",
    "ffr_dyn.scene_file.write": "save_scene to_toml",
    "ffr_dyn.studies.plan": "Study load_study study",
    "ffr_dyn.studies.sweep": "sweep",
    "ffr_dyn.studies.table": "Table load_table",
    "ffr_dyn.studies.draw": "plot_study",
    "ffr_dyn.chart.diagram": "Diagram measures_of work_precision",
    "ffr_dyn.chart.draw": "draw_chart",
    "ffr_dyn.chart.orders": "orders",
    "ffr_dyn.chart.page": "write_page",
    "ffr_dyn.chart.runner": "Span pool",
    "ffr_dyn.chart.table": "write_table",
    "ffr_dyn.chart.variants": "Model models_of",
    "ffr_dyn.economy.adaptive": "Adaptation adaptive_forward",
    "ffr_dyn.economy.outputs": "Output",
    "ffr_dyn.economy.picture": "diagram",
    "ffr_dyn.economy.report": "as_text write_report",
    "ffr_dyn.economy.result": "Economy",
    "ffr_dyn.economy.search": "economise",
    "ffr_dyn.cli.progress_bar": "progress",
}
__all__, __getattr__, __dir__ = front_door(__name__, _BY_MODULE)


if TYPE_CHECKING:  # the same names, for editors and checkers of types
    # fmt: off
    # isort: off
    __version__: str
    from ffr_prep.body import (
        FlexibleBody as FlexibleBody, load_body as load_body, rigid_body as rigid_body, save_body as save_body,
        truncated as truncated, with_point as with_point
    )
    from ffr_prep.common.errors import ComputationError as ComputationError, InputError as InputError
    from ffr_prep.common.registry import load_plugin as load_plugin
    from ffr_dyn.functions.curves import Curve as Curve
    from ffr_dyn.functions.formula import formula as formula
    from ffr_dyn.functions.time_functions import (
        TimeFunction as TimeFunction, constant as constant, harmonic as harmonic, piecewise as piecewise, polynomial
        as polynomial, signal as signal, table as table, user as user
    )
    from ffr_dyn.scene.couplings import Coupling as Coupling
    from ffr_dyn.scene.drivers import Driver as Driver, PointDriver as PointDriver
    from ffr_dyn.scene.forces import (
        Actuator as Actuator, Bushing as Bushing, JointFriction as JointFriction, JointSpring as JointSpring, JointStop
        as JointStop, Load as Load, ModalForce as ModalForce, NodalForces as NodalForces, Pressure as Pressure, Servo
        as Servo, SpringDamper as SpringDamper
    )
    from ffr_dyn.scene.force_kinds import register_force as register_force
    from ffr_dyn.scene.forces.force import Force as Force
    from ffr_dyn.scene.forces.places import (
        AlongLine as AlongLine, AtMarker as AtMarker, BetweenAxes as BetweenAxes, OnBody as OnBody, OnJoint as OnJoint
    )
    from ffr_dyn.scene.joints import Joint as Joint, register_joint as register_joint
    from ffr_dyn.scene.scene import Body as Body, Scene as Scene
    from ffr_dyn.scene.sensors import (
        Measurement as Measurement, SectionMeasurement as SectionMeasurement, StressMeasurement as StressMeasurement
    )
    from ffr_dyn.variants.variant import vary as vary, with_modes as with_modes, without_terms as without_terms
    from ffr_dyn.integrators import (
        AdaptiveROS3 as AdaptiveROS3, DormandPrince as DormandPrince, GeneralisedAlpha as GeneralisedAlpha, HHT as
        HHT, HalfExplicit as HalfExplicit, Integrator as Integrator, RK4 as RK4, ROS2 as ROS2, ROS3 as ROS3,
        Tolerances as Tolerances, Variational as Variational, Within as Within, register_integrator as
        register_integrator, tolerances as tolerances
    )
    from ffr_dyn.integrators.stabilisation import Baumgarte as Baumgarte, Drifting as Drifting, Projection as Projection
    from ffr_dyn.compile.first_use import begin_compiling as begin_compiling
    from ffr_dyn.results.file import load_result as load_result, save_result as save_result
    from ffr_dyn.results.result import Axis as Axis, Quantity as Quantity, Result as Result, write_csv as write_csv
    from ffr_dyn.results.stress import (
        hot_spots as hot_spots, peaks as peaks, section_forces as section_forces, section_histories as
        section_histories, section_peaks as section_peaks, stress_histories as stress_histories
    )
    from ffr_dyn.results.stress_error import stress_error as stress_error
    from ffr_dyn.consistency.assemble import Assembled as Assembled, assemble as assemble
    from ffr_dyn.consistency.mobility import Mobility as Mobility, mobility as mobility
    from ffr_dyn.consistency.validity import in_enough_parts as in_enough_parts, parts_needed as parts_needed
    from ffr_dyn.pictures.animate import animate as animate
    from ffr_dyn.pictures.export import export as export
    from ffr_dyn.pictures.histories import plot as plot, plot_path as plot_path
    from ffr_dyn.pictures.scene_view import show as show
    from ffr_dyn.pictures.viewer import Viewer as Viewer
    from ffr_dyn.pictures.stress_report import report_lines as report_lines, stress_report as stress_report
    from ffr_dyn.analyses.batch import forward_many as forward_many
    from ffr_dyn.analyses.inversion.bounded import Bounded as Bounded
    from ffr_dyn.analyses.efforts import (
        JointEffort as JointEffort, MarkerEffort as MarkerEffort, recorded as recorded, with_effort as with_effort
    )
    from ffr_dyn.analyses.events import Event as Event
    from ffr_dyn.analyses.forward import Forward as Forward, forward as forward
    from ffr_dyn.analyses.inverse import (
        Dynamic as Dynamic, Inverse as Inverse, QuasiStatic as QuasiStatic, inverse as inverse
    )
    from ffr_dyn.analyses.kinematic import Kinematic as Kinematic, kinematic as kinematic
    from ffr_dyn.analyses.linearise import (
        Linearisation as Linearisation, Linearise as Linearise, linearise as linearise
    )
    from ffr_dyn.analyses.mixed import Causal as Causal, Mixed as Mixed, mixed as mixed
    from ffr_dyn.analyses.reference import IDA as IDA, SciPy as SciPy, reference as reference
    from ffr_dyn.analyses.registry import (
        OfMoment as OfMoment, OverTime as OverTime, option as option, register_analysis as register_analysis
    )
    from ffr_dyn.pictures.bode import draw_bode as draw_bode, draw_nyquist as draw_nyquist
    from ffr_dyn.pictures.campbell import draw_campbell as draw_campbell
    from ffr_dyn.analyses.rotating.campbell import Campbell as Campbell, campbell as campbell
    from ffr_dyn.analyses.rotating.mode_motion import mode_motion as mode_motion
    from ffr_dyn.analyses.rotating.periodic import (
        Periodic as Periodic, floquet_motion as floquet_motion, periodic as periodic
    )
    from ffr_dyn.analyses.rotating.response import Response as Response, response as response
    from ffr_dyn.analyses.rotating.forced import Forced as Forced, forced as forced
    from ffr_dyn.pictures.forced import draw_forced as draw_forced
    from ffr_dyn.analyses.rotating.steady import Steady as Steady, steady as steady
    from ffr_dyn.analyses.run import run as run
    from ffr_dyn.analyses.settings import Charted as Charted, MomentSettings as MomentSettings, Settings as Settings
    from ffr_dyn.analyses.assemble import Assemble as Assemble, assembly as assembly
    from ffr_dyn.analyses.states import held as held, scene_at as scene_at
    from ffr_dyn.analyses.static import Static as Static, static as static
    from ffr_dyn.realtime.deadline import Timing as Timing, measure_steps as measure_steps
    from ffr_dyn.realtime.stepper import Stepper as Stepper
    from ffr_dyn.scene_file.read import load_scene as load_scene
    from ffr_dyn.scene_file.write import save_scene as save_scene, to_toml as to_toml
    from ffr_dyn.studies.plan import Study as Study, load_study as load_study, study as study
    from ffr_dyn.studies.sweep import sweep as sweep
    from ffr_dyn.studies.table import Table as Table, load_table as load_table
    from ffr_dyn.studies.draw import plot_study as plot_study
    from ffr_dyn.chart.diagram import Diagram as Diagram, measures_of as measures_of, work_precision as work_precision
    from ffr_dyn.chart.draw import draw_chart as draw_chart
    from ffr_dyn.chart.orders import orders as orders
    from ffr_dyn.chart.page import write_page as write_page
    from ffr_dyn.chart.runner import Span as Span, pool as pool
    from ffr_dyn.chart.table import write_table as write_table
    from ffr_dyn.chart.variants import Model as Model, models_of as models_of
    from ffr_dyn.economy.adaptive import Adaptation as Adaptation, adaptive_forward as adaptive_forward
    from ffr_dyn.economy.outputs import Output as Output
    from ffr_dyn.economy.picture import diagram as diagram
    from ffr_dyn.economy.report import as_text as as_text, write_report as write_report
    from ffr_dyn.economy.result import Economy as Economy
    from ffr_dyn.economy.search import economise as economise
    from ffr_dyn.cli.progress_bar import progress as progress

"""Joints, couplings and drivers of a scene as blocks of words, and all their rows at a state, in readable form."""

from __future__ import annotations

from dataclasses import dataclass

from ffr_dyn.equations.constraints import Row, evaluate_word
from ffr_dyn.equations.layout import Layout
from ffr_dyn.functions.time_functions import evaluate
from ffr_dyn.scene.couplings import Coupling, coupling_word
from ffr_dyn.scene.drivers import Driver, PointDriver, driver_word, path_words
from ffr_dyn.scene.joints import DISTANCE, RELATION, Joint, Word, words
from ffr_dyn.scene.scene import Scene, joint_of, joints_of, marker_number
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import InputError


@dataclass(frozen=True, repr=False)
class Block(Brief):
    """The rows of one joint, driver or coupling.

    markers : numbers of markers i, j, or i, j of both joints of a relation
    driver  : whether it prescribes a motion
    """

    name: str
    markers: tuple[int, ...]
    words: tuple[Word, ...]
    driver: bool = False


@dataclass(frozen=True)
class Instant:
    """A scene and its rows at a time [s] and a state."""

    scene: Scene
    place: Layout
    blocks: tuple[Block, ...]
    t: float
    x: Array
    v: Array


def blocks_of(scene: Scene) -> list[Block]:
    """Joints, then couplings, then drivers, as blocks of words."""
    joints = [_joint_block(scene, joint) for joint in scene.joints]
    couplings = [_coupling_block(scene, coupling) for coupling in scene.couplings]
    return joints + couplings + [_driver_block(scene, driver) for driver in scene.drivers]


def _ends(scene: Scene, joint: Joint | PointDriver) -> tuple[int, int]:
    return marker_number(scene, joint.i), marker_number(scene, joint.j)


def _joint_block(scene: Scene, joint: Joint) -> Block:
    ends, said = _ends(scene, joint), tuple(words(joint))
    related = any(word.kind == RELATION for word in said)
    return Block(joint.name, ends + ends if related else ends, said)


def _coupling_block(scene: Scene, coupling: Coupling) -> Block:
    first, second = joints_of(scene, coupling)
    word = coupling_word(coupling, first, second)
    return Block(coupling.name, _ends(scene, first) + _ends(scene, second), (word,))


def _driver_block(scene: Scene, driver: Driver | PointDriver) -> Block:
    if isinstance(driver, PointDriver):
        return Block(driver.name, _ends(scene, driver), tuple(path_words(driver)), driver=True)
    joint = joint_of(scene, driver)
    return Block(driver.name, _ends(scene, joint), (driver_word(driver, joint),), driver=True)


def rows_at(scene: Scene, place: Layout, blocks: list[Block], x: Array, v: Array, time: float) -> list[Row]:
    """All rows of the blocks, readable form. InputError for a distance that is not positive at the time."""
    return [
        evaluate_word(scene, place, x, v, word, block.markers, drive_at(block, word, time))
        for block in blocks
        for word in block.words
    ]


def drive_of(word: Word, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative of what a word prescribes; zeros where it prescribes nothing."""
    if word.function is None:
        return 0.0, 0.0, 0.0
    try:
        return evaluate(word.function, time)
    except (ValueError, ZeroDivisionError, OverflowError) as error:
        raise InputError(
            f"the function of time has no value at t = {time:.6g} s ({error}); let the run start where it has one, or "
            "write it another way"
        ) from None


def drive_at(block: Block, word: Word, time: float) -> tuple[float, float, float]:
    """As `drive_of`, of a word of a block by name. Raises InputError also for a distance that is not positive."""
    try:
        drive = drive_of(word, time)
    except InputError as error:
        raise InputError(f"{'driver' if block.driver else 'joint'} {block.name!r}: {error}") from None
    if word.kind == DISTANCE and not drive[0] > 0:
        raise InputError(f"joint {block.name!r}: length is {drive[0]:.4g} m at t = {time:.6g} s; it must be positive")
    return drive

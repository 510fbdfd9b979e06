"""Results in netCDF-4 files: self-describing, readable by netCDF4, xarray, h5py and ncdump, and safe from a kill.

A netCDF-4 file is an HDF5 file with dimension scales, so h5py writes it directly. (h5netcdf would do, but it looks at
every variable whenever one is made or resized: seconds for some hundred quantities.) Layout, after the CF conventions:

* dimension ``time`` [s], unlimited; each quantity is a variable of its dotted name with ``units`` and ``long_name``;
* every other axis is a dimension with a coordinate variable of labels: xyz, euler_parameter, <body>.mode;
* group ``geometry/<body>``: points (point, xyz) [m], triangles (triangle, corner), Phi (point, xyz, mode) [kg^-0.5]; where
  the body has them, stress (point, component, mode) [Pa/(m sqrt(kg))] with the components xx, yy, zz, xy, xz, yz, moduli
  (point, modulus) and the group beams of section forces (element, place, force, mode); groups second, second_stress and
  beams/second hold what is quadratic in the modes, shapes (..., part) and weights (part, mode_1, mode_2);
* where a run can be continued, group ``checkpoint`` with the bytes of `ffr_dyn.analyses.checkpoint`, those of the last row;
* attributes: Conventions, title, source, status, and those of the result; text and numbers as they are, any other
  JSON value in the attribute ``json_attributes``. No pickle.

Histories carry Fletcher-32 checksums, so a damaged value is an error and never a wrong number.
"""

from __future__ import annotations

import errno
import functools
import json
import os
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import h5py
import numpy as np

from ffr_dyn.results.result import XYZ, Axis, Quantity, Result, check_times
from ffr_prep.body import QuadraticField, Surface, surface_arrays, surface_of
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.hdf5 import HOW, abandon, check_heaps, why
from ffr_prep.common.interrupts import undisturbed
from ffr_prep.common.outputs import check_output, replacing, writing
from ffr_prep.common.reading import nearest_file, not_of_its_ending

FORMAT = "ffr-result"
FORMAT_VERSION = 1
STUDY = "ffr_study"  # what marks the table of a study

_SURFACE = ("points", "triangles", "Phi", "stress", "moduli", "beams/positions", "beams/axes", "beams/modes")
_SECOND = ("second", "second_stress", "beams/second")
_CHUNK_BYTES, _CHUNK_ROWS = 32768, 512
_BUFFER_BYTES = 4 << 20
_SPARE_BYTES, _SPARE_OF_QUANTITY = 1 << 16, 4096  # for what HDF5 keeps beside the values
_MARKS = ("Conventions", "ffr_format", "ffr_format_version", "json_attributes")


def save_result(result: Result, path: str | Path) -> Path:
    """Write the result to one file, atomically: an existing file is replaced only by a complete new one.

    >>> fd.save_result(result, "result.nc")
    """
    writer = ResultWriter(path, result)
    writer.close(result.attributes.get("status", "complete"))
    return writer.path


def load_result(path: str | Path) -> Result:
    """Read a result file. Raises InputError for a missing, damaged, truncated, foreign or newer file.

    >>> result = fd.load_result("result.nc")
    """
    path = Path(path)
    with _reading(path) as file:
        return _read(file)


def with_attributes(path: str | Path, attributes: Mapping[str, Any]) -> None:
    """Give a finished result file other attributes, in one piece: it is replaced by its copy with them."""
    with replacing(path) as part:
        shutil.copyfile(path, part)
        with h5py.File(part, "r+", **HOW) as file:
            _write_attributes(file, attributes)
            file.attrs["status"] = attributes.get("status", "complete")


@contextmanager
def _reading(path: Path) -> Iterator[h5py.File]:
    """A result file, open; whatever is wrong with it becomes an InputError."""
    if path.is_dir():
        raise InputError(f"{path} is a folder; name a result file in it")
    if path.exists() and not path.is_file():
        raise InputError(f"{path} is no ordinary file; name a result file")
    if not path.exists():
        raise InputError(
            f"result file {path} does not exist; make it with `ffr-dyn run SCENE.toml -o {path.name}`{nearest_file(path)}"
        )
    try:
        check_heaps(path)
        with h5py.File(path, "r") as file:
            _check_format(path, file)
            yield file
    except Exception as error:  # HDF5 and what reads it fail in any way
        if isinstance(error, InputError) and str(path) in str(error):
            raise
        raise InputError(not_of_its_ending(path, "a result file", _damaged(error))) from None


def _damaged(error: Exception) -> str:
    return f"is damaged, truncated or not a result file ({error}); run the analysis again"


def load_checkpoint(path: str | Path) -> Array | None:
    """The bytes from which the run of a result file can be continued; None where the file has none.

    Raises InputError for a missing or damaged file.
    """
    path = Path(path)
    with _reading(path) as file:
        return file["checkpoint/state"][:] if "checkpoint/state" in file else None


def _whole(step: Callable[..., None]) -> Callable[..., None]:
    """A step of the writer that signals do not break: they wait until it is done."""

    @functools.wraps(step)
    def done(*arguments: Any, **settings: Any) -> None:
        with undisturbed():
            step(*arguments, **settings)

    return done


class _Entry(NamedTuple):
    """Rows of the time and of all quantities, in order, and the checkpoint after them."""

    columns: list[Array]
    checkpoint: Array | None


class ResultWriter:
    """Writes a result while it grows. After a kill, ``path`` holds a complete file with all rows up to the last flush.

    Rows go to the working file ``<name>.part``, which is locked: a second run to the same path is refused. A flush closes
    it, copies it to ``<name>.new``, brings that to the disk (fsync) and renames it over ``path``: the rename is atomic, so
    until the first flush is complete ``path`` keeps what it held before, and readers of the old file are undisturbed. A
    copy takes time in proportion to the length of the file, so equally spaced flushes would cost O(n^2) in all. Therefore
    the time between flushes is at least ``interval`` [s] and at least the duration of the last flush over ``share``: the
    run is never slowed down by more than that share, and a kill loses no more than the time since the last flush. Memory
    is a buffer of a few MB, however long the run. The last flush needs no copy. The working files of a killed run are
    overwritten by the next run to the same path, and may be deleted.

    Space on the disk is taken before rows are handed to HDF5, which does not survive a full disk: where there is none, the
    run stops, and ``path`` gets all rows that were written. Signals that end the process wait for the end of a step, and
    what was computed until then is kept.

    path   : the file to write; its directory is made if necessary
    header : quantities, geometry and attributes, and the first rows (none, or those of a run to be continued)
    checkpoint : bytes (uint8) from which the run can go on after the rows of the header

    As a context manager it closes with the status "complete", or "stopped: ..." when an exception passes through, to which
    it adds a note on what is kept; a run that stopped before its first row leaves ``path`` as it was.
    Raises InputError when path cannot be written, ComputationError when writing fails later (such as a full disk).
    """

    def __init__(
        self,
        path: str | Path,
        header: Result,
        *,
        checkpoint: Array | None = None,
        interval: float = 5.0,
        share: float = 0.03,
    ) -> None:
        self.path = Path(path)
        self._interval, self._share = interval, share
        self._names = tuple(header.quantities)
        self._shapes = [quantity.values.shape[1:] for quantity in header.quantities.values()]
        self._pending: list[_Entry] = []
        self._pending_bytes = 0
        self._rows = header.time.size
        self._last_time = header.time[-1:]
        self._checkpoint = checkpoint
        self._held, self._published = ExitStack(), False
        self._file: Any = None
        try:
            self._begin(header)
        except (OSError, ComputationError) as error:
            self._give_up()
            raise InputError(
                f"{self.path} cannot be written ({why(error.__cause__ or error)}); choose another place, or make room there"
            ) from None
        self._published_at = time.monotonic()
        self._publishing_took = 0.0

    @_whole
    def _begin(self, header: Result) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._part = self._held.enter_context(writing(self.path))
        self._file = h5py.File(self._part, "w", track_order=True, **HOW)
        self._take_space(_bytes_of(header))
        _write_structure(self._file, header)
        self._keep_checkpoint()

    @_whole
    def append(self, times: Array, values: Mapping[str, Array], checkpoint: Array | None = None) -> None:
        """Add k rows: times (k,) [s] and, for every quantity of the header, values (k, ...). Flushes when it is due.

        checkpoint : bytes (uint8) from which the run can go on after these rows; kept with them, in place of the last
        """
        times = np.array(times, dtype=np.float64)
        check_times(np.concatenate([self._last_time, times]))
        if values.keys() != set(self._names):
            raise InputError(
                f"rows must hold the quantities of the header; differing: {values.keys() ^ set(self._names)}"
            )
        rows = [np.array(values[name], dtype=np.float64) for name in self._names]
        for name, row, shape in zip(self._names, rows, self._shapes, strict=True):
            if row.shape != (times.size, *shape):
                raise InputError(f"rows of {name!r} have shape {row.shape}, not {(times.size, *shape)}")
        self._pending.append(_Entry([times, *rows], checkpoint))
        self._pending_bytes += sum(row.nbytes for row in rows)
        self._last_time = np.append(self._last_time, times)[-1:]
        if time.monotonic() - self._published_at >= max(self._interval, self._publishing_took / self._share):
            self.flush()
        elif self._pending_bytes > _BUFFER_BYTES:
            with self._explained():
                self._drain()

    @_whole
    def flush(self) -> None:
        """Publish all rows so far at ``path``, with the status "running"."""
        started = time.monotonic()
        with self._explained():
            self._drain()
            self._file.close()
            try:
                self._publish_copy()
            finally:
                self._file = h5py.File(self._part, "r+", **HOW)
        self._published_at = time.monotonic()
        self._publishing_took = self._published_at - started

    def _publish_copy(self) -> None:
        snapshot = self.path.with_name(self.path.name + ".new")
        try:
            snapshot.unlink(missing_ok=True)
            shutil.copyfile(self._part, snapshot)
            _sync(snapshot)
            check_output(self.path)
            os.replace(snapshot, self.path)
            self._published = True
        except OSError as error:
            snapshot.unlink(missing_ok=True)
            raise self._stopped(error) from error

    @_whole
    def close(self, status: str = "complete", attributes: Mapping[str, Any] | None = None) -> None:
        """Publish the finished file at ``path``; attributes, when given, replace the header's. Again does nothing."""
        if not self._file:
            return
        with self._explained():
            self._drain()
            self._take_space(2 * len(json.dumps(dict(attributes or {}), default=str)))
            self._file.close()
            self._file = h5py.File(self._part, "r+", **HOW)  # which sees the space that was taken, and gives it back
            if attributes is not None:
                _write_attributes(self._file, attributes)
            self._file.attrs["status"] = status
            self._file.close()
            _sync(self._part)
            check_output(self.path)
            os.replace(self._part, self.path)
            self._published = True
        self._held.close()

    @_whole
    def discard(self) -> None:
        """Give up the rows since the last flush; ``path`` stays as it is."""
        self._give_up()

    def __enter__(self) -> ResultWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.close()
        elif self._rows or self._pending:
            self.close(f"stopped: {str(error) or type(error).__name__}")
            if self._published:
                error.add_note(f"{self.path} holds what was computed until then")
        else:
            self.discard()

    def _drain(self) -> None:
        """Hand the rows over to HDF5; on a full disk as many as fit."""
        while self._pending:
            count = len(self._pending)
            while not self._has_space(self._pending[:count]) and count > 1:
                count //= 2
            entries, self._pending = self._pending[:count], self._pending[count:]
            self._write(entries)
        self._pending_bytes = 0

    def _has_space(self, entries: list[_Entry]) -> bool:
        """Whether the disk has what these take; ComputationError where it does not have what the first takes."""
        end = self._rows + sum(entry.columns[0].size for entry in entries)
        variables = [self._file[name] for name in ("time", *self._names)]
        chunks = sum(
            8 * int(np.prod(variable.chunks)) * (-(-end // variable.chunks[0]) - self._rows // variable.chunks[0])
            for variable in variables
        )
        checkpoint = 0 if entries[-1].checkpoint is None else entries[-1].checkpoint.nbytes
        try:
            self._take_space(chunks + checkpoint + _SPARE_OF_QUANTITY * len(variables))
        except ComputationError:
            if len(entries) == 1:
                self._pending = []
                raise
            return False
        return True

    def _write(self, entries: list[_Entry]) -> None:
        columns = [np.concatenate(parts) for parts in zip(*(entry.columns for entry in entries), strict=True)]
        end = self._rows + columns[0].shape[0]
        for name, rows in zip(("time", *self._names), columns, strict=True):
            variable = self._file[name]
            variable.resize(end, axis=0)
            variable[self._rows : end] = rows
        self._rows, self._checkpoint = end, entries[-1].checkpoint
        self._keep_checkpoint()
        self._file.flush()  # into the space that was taken

    def _keep_checkpoint(self) -> None:
        if self._checkpoint is not None:
            _write_checkpoint(self._file, self._checkpoint)

    def _take_space(self, size: int) -> None:
        """Have so many bytes more in the file, and some to close it with. ComputationError where the disk has not."""
        if not hasattr(os, "posix_fallocate"):
            return
        try:
            with open(self._part, "r+b") as stream:
                os.posix_fallocate(stream.fileno(), self._file.id.get_filesize(), size + _SPARE_BYTES)
        except OSError as error:
            if error.errno not in (errno.EOPNOTSUPP, errno.EINVAL, errno.ENOSYS):  # of file systems without this
                raise self._stopped(error) from error

    def _stopped(self, error: OSError) -> ComputationError:
        """The file itself is sound."""
        return ComputationError(
            f"writing {self.path} failed ({why(error)}); rows until then are kept: check the free space of the disk"
        )

    def _give_up(self) -> None:
        """Leave the working file, whatever state it is in."""
        if self._file:
            abandon(self._file)
            self._part.unlink(missing_ok=True)
        self._held.close()

    @contextmanager
    def _explained(self) -> Iterator[None]:
        """Explain a failure of HDF5 to write, which leaves a file that is of no use."""
        try:
            yield
        except (InputError, ComputationError):
            raise
        except (OSError, RuntimeError) as error:
            self._give_up()
            kept = "it holds the rows of before" if self._published else "it is as it was"
            raise ComputationError(
                f"writing {self.path} failed ({why(error)}); {kept}: check the free space of the disk"
            ) from error


def _bytes_of(result: Result) -> int:
    """About what a result takes in a file."""
    values = sum(
        8 * int(np.prod(_chunk(q.values))) * -(-result.time.size // _chunk(q.values)[0]) + 2 * _SPARE_OF_QUANTITY
        for q in result.quantities.values()
    )
    surfaces = sum(array.nbytes for surface in result.geometry.values() for array in surface_arrays(surface).values())
    return values + surfaces + _SPARE_BYTES


# ---- writing ------------------------------------------------------------------------------------------------------


def _write_structure(file: h5py.File, header: Result) -> None:
    _write_attributes(file, header.attributes)
    clock = _history(file, "time", header.time, "s", "simulated time")
    clock.attrs["axis"] = "T"
    clock.make_scale("time")
    axes = {axis.name: axis for quantity in header.quantities.values() for axis in quantity.axes}
    if header.geometry:
        axes[XYZ.name] = XYZ
    for axis in axes.values():
        scale = file.create_dataset(axis.name, data=list(axis.labels), dtype=h5py.string_dtype(), track_order=True)
        scale.make_scale(axis.name)
    for name, quantity in header.quantities.items():
        variable = _history(file, name, quantity.values, quantity.unit, quantity.description)
        _attach(variable, [clock, *(file[axis.name] for axis in quantity.axes)])
    geometry = file.create_group("geometry", track_order=True)
    for body, surface in header.geometry.items():
        _write_surface(geometry.create_group(body, track_order=True), file[XYZ.name], surface)


def _write_attributes(file: h5py.File, attributes: Mapping[str, Any]) -> None:
    complete = {"title": "Motion of a multibody system", "source": program(), "status": "running", **attributes}
    structured = {name: value for name, value in complete.items() if not _is_plain(value)}
    file.attrs["Conventions"] = "CF-1.11"
    file.attrs["ffr_format"] = FORMAT
    file.attrs["ffr_format_version"] = FORMAT_VERSION
    for name, value in complete.items():
        if name not in structured and name not in _MARKS:
            file.attrs[name] = value
    file.attrs["status"] = "running"
    file.attrs["json_attributes"] = json.dumps(structured)


def _is_plain(value: Any) -> bool:
    if isinstance(value, str):
        return "\0" not in value
    return type(value) is float or (type(value) is int and abs(value) < 1 << 63)


def _history(file: h5py.File, name: str, values: Array, unit: str, description: str) -> h5py.Dataset:
    chunk = _chunk(values)
    variable = file.create_dataset(
        name, data=values, maxshape=(None, *values.shape[1:]), chunks=chunk, fletcher32=True, track_order=True
    )
    variable.attrs["units"] = unit
    if description:
        variable.attrs["long_name"] = description
    return variable


def _chunk(values: Array) -> tuple[int, ...]:
    """Of a history with rows like these."""
    row_bytes = 8 * int(np.prod(values.shape[1:]))
    return (max(1, min(_CHUNK_ROWS, _CHUNK_BYTES // row_bytes)), *values.shape[1:])


def _write_surface(group: h5py.Group, xyz: h5py.Dataset, surface: Surface) -> None:
    n = surface.Phi.shape[2]
    points = _index(group, "point", len(surface.points))
    _attach(_array(group, "points", surface.points, "m", "undeformed points in the body frame"), [points, xyz])
    if len(surface.triangles):
        triangles = _array(group, "triangles", surface.triangles, "1", "indices of the corners")
        _attach(triangles, [_index(group, "triangle", len(surface.triangles)), _index(group, "corner", 3)])
    if n:
        shapes = _array(group, "Phi", surface.Phi, "kg-0.5", "mode shapes")
        mode = _index(group, "mode", n)
        _attach(shapes, [points, xyz, mode])
        _write_stress(group, points, mode, surface)
        _write_second(group, "second", surface.second, "m-1 kg-1", [points, xyz])


def _write_stress(group: h5py.Group, point: h5py.Dataset, mode: h5py.Dataset, surface: Surface) -> None:
    if surface.stress is not None and surface.moduli is not None:
        stress = _array(
            group, "stress", surface.stress, "Pa m-1 kg-0.5", "stress modes xx, yy, zz, xy, xz, yz, body axes"
        )
        component = _index(group, "component", 6)
        _attach(stress, [point, component, mode])
        _write_second(group, "second_stress", surface.second_stress, "Pa m-2 kg-1", [point, component])
        moduli = _array(group, "moduli", surface.moduli, "1", "Young's modulus [Pa] and Poisson's ratio")
        _attach(moduli, [point, _index(group, "modulus", 2)])
    if surface.beams is not None:
        beams = group.create_group("beams", track_order=True)
        element, place = _index(beams, "element", len(surface.beams.positions)), _index(beams, "place", 3)
        xyz, axis = _index(beams, "xyz", 3), _index(beams, "axis", 3)
        positions = _array(beams, "positions", surface.beams.positions, "m", "first end, middle and last end")
        _attach(positions, [element, place, xyz])
        _attach(_array(beams, "axes", surface.beams.axes, "1", "element to body axes"), [element, xyz, axis])
        forces = _array(
            beams, "modes", surface.beams.modes, "N m-1 kg-0.5", "N, Qy, Qz, Mx, My, Mz (moments: N kg-0.5)"
        )
        force = _index(beams, "force", 6)
        _attach(forces, [element, place, force, mode])
        _write_second(beams, "second", surface.beams.second, "N m-2 kg-1", [element, place, force])


def _write_second(
    group: h5py.Group, name: str, field: QuadraticField | None, unit: str, places: list[h5py.Dataset]
) -> None:
    """Write the part that is quadratic in the elastic coordinates: sum over r of shapes_r (q . weights_r q) / 2."""
    if field is None or not field.weights.size:
        return
    own = group.create_group(name, track_order=True)
    rank, n = field.weights.shape[:2]
    part, one, other = _index(own, "part", rank), _index(own, "mode_1", n), _index(own, "mode_2", n)
    _attach(_array(own, "shapes", field.shapes, unit, "what is quadratic in the modes: shapes"), [*places, part])
    _attach(_array(own, "weights", field.weights, "1", "and their quadratic weights"), [part, one, other])


def _write_checkpoint(file: h5py.File, content: Array) -> None:
    """In place where the length allows it: a deleted one would leave a hole in the file."""
    group = file.require_group("checkpoint")
    if "state" in group and group["state"].size == content.size:
        group["state"][:] = content
        return
    for name in list(group):
        del group[name]
    scale = group.create_dataset("byte", shape=content.shape, dtype=np.uint8, track_order=True)
    scale.make_scale("This is a netCDF dimension but not a netCDF variable." + f"{content.size:10}")
    state = group.create_dataset("state", data=content, chunks=content.shape, fletcher32=True, track_order=True)
    state.attrs["long_name"] = "state at the last row, from which the run can be continued"
    _attach(state, [scale])


def _array(group: h5py.Group, name: str, values: Array, unit: str, description: str) -> h5py.Dataset:
    variable = group.create_dataset(name, data=values, chunks=values.shape, fletcher32=True, track_order=True)
    variable.attrs["units"] = unit
    variable.attrs["long_name"] = description
    return variable


def _index(group: h5py.Group, name: str, size: int) -> h5py.Dataset:
    scale = group.create_dataset(name, data=np.arange(size, dtype=np.int32), track_order=True)
    scale.make_scale(name)
    return scale


def _attach(variable: h5py.Dataset, scales: list[h5py.Dataset]) -> None:
    for dimension, scale in zip(variable.dims, scales, strict=True):
        dimension.attach_scale(scale)


def _sync(path: Path) -> None:
    with open(path, "rb") as stream:
        os.fsync(stream.fileno())


def program() -> str:
    """Name and version of this program, for the provenance of files."""
    try:
        return f"ffr_dyn {version('ffr')}"
    except PackageNotFoundError:
        return "ffr_dyn (not installed)"


# ---- reading ------------------------------------------------------------------------------------------------------


def _check_format(path: Path, file: h5py.File) -> None:
    if file.attrs.get("ffr_format") != FORMAT:
        if STUDY in file.attrs:
            raise InputError(
                f"{path} is the table of a study, not a result file; read it by fd.load_table or xarray, or draw it by "
                "fd.plot_study"
            )
        raise InputError(f"{path} is not a result file (foreign header); write one with ffr-dyn")
    if file.attrs["ffr_format_version"] > FORMAT_VERSION:
        raise InputError(
            f"{path} has result format {file.attrs['ffr_format_version']}, "
            f"this program reads up to {FORMAT_VERSION}: update it"
        )


def _read(file: h5py.File) -> Result:
    variables = [name for name in file if isinstance(file[name], h5py.Dataset) and not file[name].is_scale]
    return Result(
        time=file["time"][:],
        quantities={name: _read_quantity(file[name]) for name in variables},
        geometry={body: _read_surface(group) for body, group in file["geometry"].items()},
        attributes=_read_attributes(file),
    )


def _read_quantity(variable: h5py.Dataset) -> Quantity:
    scales = [dimension[0] for dimension in variable.dims][1:]
    axes = tuple(Axis(scale.name[1:], tuple(scale.asstr()[:])) for scale in scales)
    return Quantity(variable[...], variable.attrs.get("units", "1"), axes, variable.attrs.get("long_name", ""))


def _read_surface(group: h5py.Group) -> Surface:
    points = group["points"][:]
    empty = {"triangles": np.zeros((0, 3), int), "Phi": np.zeros((len(points), 3, 0))}
    known = (*_SURFACE, *(f"{of}/{name}" for of in _SECOND for name in ("shapes", "weights")))
    return surface_of(empty | {key: group[key][:] for key in known if key in group})


def _read_attributes(file: h5py.File) -> dict[str, Any]:
    plain = {name: _native(value) for name, value in file.attrs.items() if name not in _MARKS}
    return {**plain, **json.loads(file.attrs["json_attributes"])}


def _native(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value

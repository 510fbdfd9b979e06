"""The report of a search: what is modelled, what it costs, how far off it is, and what is nearest to mattering.

One set of tables, written as text, Markdown or one page of HTML that needs nothing else.
"""

from __future__ import annotations

import html
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ffr_dyn.economy.advice import advice, tells_apart
from ffr_dyn.economy.checks import load_names
from ffr_dyn.economy.contributions import Contributions
from ffr_dyn.economy.inertia_terms import TermEffect
from ffr_dyn.economy.model_choice import Choice, kind
from ffr_dyn.economy.result import Economy
from ffr_dyn.scene.scene import INERTIA_TERMS
from ffr_prep.common.errors import InputError
from ffr_prep.common.outputs import replacing

SEPARATOR = "  "


@dataclass(frozen=True)
class Table:
    """A heading, a sentence about it, names of columns, and rows of text."""

    title: str
    text: str
    columns: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()


def tables(found: Economy) -> list[Table]:
    """The report, part after part."""
    parts = [_summary(found), _outputs(found), _bodies(found), _nearest(found)]
    parts += [_terms(found)] if found.terms else []
    parts += [*_checks(found), _tried(found), _advice(found)]
    notes = _notes(found)
    return [*parts, Table("Notes", "", (), tuple((note,) for note in notes))] if notes else parts


def _summary(found: Economy) -> Table:
    choice, settings = found.choice, found.settings
    rows = [
        ("scene", found.original.name),
        ("computed", "in space" if choice.plane == "none" else f"in the plane across {choice.plane}"),
        ("integrator", _integrator(choice, settings.output_step / choice.divisions)),
        ("stabilisation", repr(settings.stabilisation)),
        ("elastic coordinates", f"{choice.count} of {sum(b.model.n for b in found.original.bodies)}"),
        ("cost of a run", f"{found.cost / 1e6:.3g} s, the full model with the same step {found.before / 1e6:.3g} s: "
                          f"{found.before / found.cost:.1f} times as much (cost model)"),
        ("cost of the search", f"{found.search_cost / found.cost:.1f} runs of the chosen model"),
    ]  # fmt: skip
    return Table("Chosen model", _verdict(found), ("", ""), tuple(rows))


def _integrator(choice: Choice, step: float) -> str:
    if choice.controlled:
        return f"{choice.method}, which chooses its steps, with a relative tolerance of {choice.accuracy:g}"
    return f"{choice.method}, step {step:.6g} s ({choice.divisions} to an output row)"


def _verdict(found: Economy) -> str:
    verified = found.verification
    if verified is None:
        worst = float((found.error / found.limits).max())
        return f"Estimated: all outputs are within their tolerances; {_largest(worst)}."
    worst = float((verified.error / found.limits).max())
    refined = f"{verified.attempts} refinement{'s' * (verified.attempts > 1)}"
    again = f" after {refined} of the model that the estimates had chosen" if verified.attempts else ""
    if not verified.is_known:
        known = float((verified.own / found.limits).max())
        apart = float(((verified.error - verified.own) / found.limits).max())
        if apart > 1 and known < apart:
            return f"NOT within its tolerances{again}: against the full model {_largest(apart)}."
        return (
            f"Estimated, not verified{again}: in the time allowed the reference is known to {known:.2g} of a tolerance, "
            f"where a verification needs {found.policy.reference_share:g}. Larger tolerances and fewer outputs take less; "
            "damping helps, since undamped modes ring at every step."
        )
    if worst > 1:
        return f"NOT within its tolerances{again}: in the verification {_largest(worst)}."
    return f"Verified{again}: all outputs are within their tolerances; {_largest(worst)}."


def _largest(of_tolerance: float) -> str:
    return f"the largest error is {of_tolerance:.2g} times its tolerance"


def _outputs(found: Economy) -> Table:
    columns: tuple[str, ...] = ("output", "unit", "range", "tolerance", "left out", "step", "estimated")
    verified = found.verification
    if verified:
        columns += (
            "true",
            "estimated / true",
            "verified" if verified.is_known else "model and reference",
            "of tolerance",
        )
    rows = []
    for k, output in enumerate(found.probe.outputs):
        numbers = (found.scales, found.limits, found.model_error, found.time_error, found.error)
        row: tuple[str, ...] = (output.name, found.probe.units[k], *(f"{column[k]:.3g}" for column in numbers))
        if verified:
            true, error = verified.first[k], verified.error[k]
            ratio = f"{found.error[k] / true:.2f}" if true > verified.own[k] else "-"
            row += (f"{true:.3g}", ratio, f"{error:.3g}", f"{error / found.limits[k]:.2g}")
        rows.append(row)
    text = "Largest errors over the run: of what is left out of the model, of the step, and of both together."
    if found.together:
        text += " One run beside the full model gives the error of the step together with that of what is left out."
    if verified:
        own = ", ".join(f"{value:.1g}" for value in verified.own)
        last = (
            "the last two columns add it, and are of the chosen model"
            if verified.attempts
            else "the last two columns add it"
        )
        text += (
            f" True errors are those against the full model by {verified.choice.method} with {verified.choice.divisions} "
            f"steps to a row, whose own error is {own}; {last}."
        )
        text += (
            " The columns before them are of the model that the estimates had chosen at first."
            if verified.attempts
            else ""
        )
    return Table("Outputs", text, columns, tuple(rows))


def _bodies(found: Economy) -> Table:
    rows = []
    for b, (body, part) in enumerate(zip(found.original.bodies, found.choice.parts, strict=True)):
        if body.model.n == 0:
            rows.append((body.name, "rigid (given)", "-", "-", "-", "-"))
            continue
        what = kind(found.original, found.choice, b, found.settings.output_step)
        kept = [term for term in INERTIA_TERMS if term not in part.dropped]
        dropped = [term for term in INERTIA_TERMS if term in part.dropped]
        flexible = part.count > 0
        rows.append((
            body.name, what, _modes(found, b),
            " ".join(kept) if flexible else "-", " ".join(dropped) or "-" if flexible else "-", _stiffening(found, b),
        ))  # fmt: skip
    text = (
        "Quasi-static: all frequencies of the body are above what the step resolves, so it deforms without vibrating. A "
        "shape is a combination of modes; a few hold the deformation of this motion. Modes are counted from 1, as in "
        f"`ffr-prep info`{_of_mean_motion(found)}."
    )
    columns = ("body", "modelled", "elastic coordinates", "terms kept", "terms dropped", "stiffening")
    return Table("Bodies", text, columns, tuple(rows))


def _of_mean_motion(found: Economy) -> str:
    names = [repr(b.name) for b in found.original.bodies if b.name in found.new_frames and b.model.n]
    if not names:
        return ""
    return f"; of {', '.join(names)} those of the body in its mean axes (`ffr-prep convert --reference mean-axis`)"


def _number(found: Economy, b: int, mode: int) -> int:
    """The number of a mode as `ffr-prep info` counts it: by frequency in mean axes, where it is found by symmetry."""
    body = found.original.bodies[b]
    if body.name not in found.new_frames:
        return mode + 1
    return 1 + int(np.flatnonzero(np.argsort(body.model.omega2, kind="stable") == mode)[0])


def _modes(found: Economy, b: int) -> str:
    body, part = found.original.bodies[b], found.choice.parts[b]
    if not part.count:
        return "none"
    V = part.basis(body.model.n)
    hertz = np.sqrt(np.einsum("ia,i,ia->a", V, body.model.omega2, V)) / (2 * np.pi)
    if part.shapes is None:
        modes = sorted(zip((_number(found, b, mode) for mode in part.modes), hertz, strict=True))
        return ", ".join(f"{number} ({f:.4g} Hz)" for number, f in modes)
    return f"{part.count} shape{'s' * (part.count > 1)} of {len(part.modes)} modes: " + ", ".join(
        f"{f:.4g} Hz" for f in hertz
    )


def _stiffening(found: Economy, b: int) -> str:
    if found.original.bodies[b].model.stiffening is None:
        return "not in the body"
    part = found.choice.parts[b]
    if not part.count or not part.stiffened:
        return "dropped" if part.count else "-"
    names = load_names(found.original.bodies[b])
    return "kept" if part.loads is None else "by " + ", ".join(names[k] for k in part.loads)


def _nearest(found: Economy) -> Table:
    out = [("left out", *row) for row in _leading(found, found.effects, most=True) if tells_apart(found)]
    kept = [("kept", *row) for row in _leading(found, found.kept, most=False)]
    text = (
        "What the omitted modes would do to the outputs, the largest first; and what the kept modes do, the smallest first. "
        "In units of the tolerance."
    )
    if not tells_apart(found):
        text += (
            " Omitted modes are not listed: each alone would do more than all of them do, since joints that hold bodies more "
            "than once let them move only together."
        )
    return Table("Nearest to mattering", text, ("", "mode", "output", "share"), (*out, *kept))


def _terms(found: Economy) -> Table:
    """The table of inertia terms and stiffening loads: those dropped that do most, and those kept that do least."""
    here = [one for one in found.terms if found.choice.parts[one.body].count]
    out = [one for one in here if not kept(found.choice, one)]

    def size(one: TermEffect) -> float:
        return float((one.effect / found.limits).max(initial=0.0))

    most = found.policy.shown_rows
    listed = [("dropped", one) for one in sorted(out, key=size, reverse=True)[:most]]
    listed += [("kept", one) for one in sorted((one for one in here if one not in out), key=size)[: most // 2]]
    rows = tuple((state, *_said(found, one)) for state, one in listed)
    text = (
        "What each inertia term and the stiffening by each load do to the outputs, along the motion of the full model. In "
        "units of the tolerance. The errors above include those of the dropped ones."
    )
    return Table("Terms nearest to mattering", text, ("", "term", "output", "share"), rows)


def kept(choice: Choice, one: TermEffect) -> bool:
    """Whether a model has a term."""
    part = choice.parts[one.body]
    if one.load is None:
        return one.term not in part.dropped
    return part.stiffened and (part.loads is None or one.load in part.loads)


def _said(found: Economy, one: TermEffect) -> tuple[str, str, str]:
    body, shares = found.original.bodies[one.body], one.effect / found.limits
    term = one.term if one.load is None else f"{one.term} by {load_names(body)[one.load]}"
    output = int(np.argmax(shares))
    return f"{body.name}, {term}", found.probe.outputs[output].name, f"{shares[output]:.2g}"


def _leading(found: Economy, effects: Contributions, *, most: bool) -> Iterator[tuple[str, str, str]]:
    if not len(effects.body):
        return
    shares = effects.effect / found.limits
    order = np.argsort(-shares.max(axis=1) if most else shares.max(axis=1), kind="stable")
    for k in order[: found.policy.shown_rows if most else found.policy.shown_rows // 2]:
        body = found.original.bodies[effects.body[k]]
        output = int(np.argmax(shares[k]))
        number = _number(found, int(effects.body[k]), int(effects.mode[k]))
        name = f"{body.name}, mode {number} ({body.model.frequencies[effects.mode[k]]:.4g} Hz)"
        yield name, found.probe.outputs[output].name, f"{shares[k, output]:.2g}"


def _checks(found: Economy) -> Iterator[Table]:
    if found.frequencies:
        shifts = tuple((f"{f.model:.5g}", f"{f.everything:.5g}", f"{100 * f.shift:+.2g} %") for f in found.frequencies)
        text = (
            "Frequencies of small motions half-way through the run, beside the nearest of the full model. A shift by more "
            "than some per cent means vibration at a wrong frequency, which the table of omitted modes does not show."
        )
        yield Table("Frequencies [Hz]", text, ("model", "full model", "shift"), shifts)
    if found.stiffening:
        listed = [one for one in found.stiffening if one.share > 0][: 2 * found.policy.shown_rows]
        least = found.policy.needed_stiffening
        rows = tuple((s.body, s.load, f"{s.share:.2g}", "needed" if s.share > least else "could go") for s in listed)
        text = "Largest change of the stiffness of a mode by each load on bodies whose stiffening is kept, as a share of it."
        yield Table("Stiffening by load", text, ("body", "load", "share", ""), rows)


def _tried(found: Economy) -> Table:
    rows = []
    for one in found.tried:
        coordinates = " ".join(str(part.count) for part in one.choice.parts)
        worst = float((one.error / found.limits).max(initial=0.0))
        steps = f"{one.choice.accuracy:g}" if one.choice.controlled else f"{one.choice.divisions}"
        method = f"{one.choice.method}/{steps}"
        rows.append((one.what, coordinates, method, f"{one.cost / found.cost:.2f}", f"{worst:.3g}"))
    text = (
        "Cost: in runs of the chosen model. Error: in units of the tolerance; of trials against the full model with the same "
        "step, of the chosen model with the error of its step."
    )
    return Table("Models tried", text, ("model", "coordinates by body", "integrator", "cost", "error"), tuple(rows))


def _advice(found: Economy) -> Table:
    lines = advice(found)
    text = (
        "What the scene needs of its bodies, as commands to run; FILE is the geometry, the mesh or the structure of the body."
        if lines
        else "No flexible bodies."
    )
    return Table("Mesh and reduction", text, (), tuple((line,) for line in lines))


def _notes(found: Economy) -> list[str]:
    prescribed = [
        f"output {name!r} is the same with rigid and with flexible bodies: no model changes it, its tolerance says nothing "
        "about modes and terms"
        for name in found.unmoved
    ]
    return [*prescribed, *found.notes]


# ---- as text ------------------------------------------------------------------------------------------------------


def as_text(found: Economy) -> str:
    """The report in columns, for a terminal.

    >>> print(fd.as_text(found))
    """
    return "\n".join(line for table in tables(found) for line in _plain(table))


def _plain(table: Table) -> Iterator[str]:
    yield f"{table.title.upper()}"
    if table.text:
        yield table.text
    head = [table.columns] if any(table.columns) else []
    listed = [*head, *table.rows]
    widths = [max((len(row[k]) for row in listed), default=0) for k in range(len(listed[0]) if listed else 0)]
    for row in listed:
        yield SEPARATOR + SEPARATOR.join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
    yield ""


def as_markdown(found: Economy, picture: str | None = None) -> str:
    """The report in Markdown; `picture` a file to show."""
    lines = [f"# Economised model: {found.original.name}", ""]
    for table in tables(found):
        lines += [f"## {table.title}", "", *([table.text, ""] if table.text else [])]
        if table.columns:
            lines += [_row(table.columns), _row(("---",) * len(table.columns)), *map(_row, table.rows), ""]
        else:
            lines += [*(f"* {row[0]}" for row in table.rows), ""]
    if picture:
        lines += ["## Chart", "", f"![cost and error of all models tried]({picture})", ""]
    return "\n".join(lines)


def _row(cells: tuple[str, ...]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


_STYLE = (
    "body{font:15px/1.5 sans-serif;max-width:72em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;margin:.5em 0 1.5em}td,th{border:1px solid #ccc;padding:.25em .6em;text-align:left}"
    "th{background:#f2f2f2}li{font-family:monospace;margin:.3em 0}img{max-width:100%}"
)


def as_html(found: Economy, picture: bytes | None = None) -> str:
    """The report as one page; `picture` a PNG that it shows."""
    import base64

    title = f"Economised model: {found.original.name}"
    parts = [f"<h1>{html.escape(title)}</h1>", *(_section(table) for table in tables(found))]
    if picture is not None:
        data = base64.b64encode(picture).decode()
        parts.append(f'<h2>Chart</h2><img alt="cost and error of all models tried" src="data:image/png;base64,{data}">')
    head = f'<meta charset="utf-8"><title>{html.escape(title)}</title><style>{_STYLE}</style>'
    return f'<!doctype html><html lang="en"><head>{head}</head><body>{"".join(parts)}</body></html>\n'


def _section(table: Table) -> str:
    text = f"<h2>{html.escape(table.title)}</h2>" + (f"<p>{html.escape(table.text)}</p>" if table.text else "")
    if not table.columns:
        return text + "<ul>" + "".join(f"<li>{html.escape(row[0])}</li>" for row in table.rows) + "</ul>"
    head = "".join(f"<th>{html.escape(cell)}</th>" for cell in table.columns) if any(table.columns) else ""
    rows = "".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows)
    return f"{text}<table>{f'<tr>{head}</tr>' if head else ''}{rows}</table>"


def write_report(found: Economy, path: str | Path) -> Path:
    """Write the report as .html (with the chart), .md or .txt. Raises InputError for another kind of file.

    >>> fd.write_report(found, "economy.html")
    """
    from ffr_dyn.economy.picture import draw

    path = Path(path)
    if path.suffix not in (".html", ".md", ".txt"):
        raise InputError(f"{path}: a report is written as .html, .md or .txt")
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".html":
        chart = draw(found, path.with_name(path.name + ".part.png"))
        text = as_html(found, chart.read_bytes())
        chart.unlink()
    else:
        text = as_markdown(found) if path.suffix == ".md" else as_text(found)
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")
    return path

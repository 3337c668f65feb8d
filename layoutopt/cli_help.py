"""Commands that help: what to start from, what is installed, how to cite, prices, a report written anew."""

import json
import shlex
from pathlib import Path
from typing import Annotated, Any, Final

import typer
from typer.core import TyperGroup

import layoutopt
from layoutopt.cli_parts import BUILT_IN, Jobs, attended, fit_for_file, job_count, print_lines, spec_of
from layoutopt.errors import InvalidInput, UnknownName, did_you_mean

SECTIONS: Final = {
    "Begin": ("new", "check", "doctor", "prices"),
    "Ask": ("study", "solve", "score", "explain"),
    "Build": ("draw", "snap", "commission", "expand", "replay"),
    "Studies that run or have run": ("status", "merge", "report", "reprice", "cite"),
}
"""All commands by what they are for, in the order in which a user meets them."""

AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of lines.")]


def _tell_version(asked: bool) -> None:
    """Print the version and end, if that is asked."""
    if asked:
        print_lines([f"layoutopt {layoutopt.__version__}"])
        raise typer.Exit


Version = Annotated[
    bool, typer.Option("--version", callback=_tell_version, is_eager=True, help="Print the version and end.")
]


class Commands(TyperGroup):
    """The commands of layoutopt, whose help tells each in full and what it is for."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the sections; the lines are wrapped and never cut."""
        for title, names in SECTIONS.items():
            with formatter.section(title):
                formatter.write_dl([(name, self.commands[name].help or "") for name in names])


def new(
    file: Annotated[Path | None, typer.Argument(help="File to write.")] = None,
    example: Annotated[
        str,
        typer.Option(
            "--from", help="What to start from: hospital_ward, small_hall, hybrid or prices; see --list."
        ),
    ] = BUILT_IN,
    listed: Annotated[bool, typer.Option("--list", help="Tell what there is to start from.")] = False,
) -> None:
    """Write a commented spec that runs as it is, or a price list to fill in."""
    from layoutopt.atomic_file import replacing
    from layoutopt.spec.template import PRICES, example_lines, template

    if listed:
        print_lines(example_lines())
        return
    if file is None:
        raise InvalidInput.at(
            "layoutopt new", "the name of the new file is missing", "Write layoutopt new site.toml."
        )
    if file.exists():
        raise InvalidInput.at(str(file), "it exists already", "Choose another name.")
    fit_for_file("FILE", file)
    text = template(example)
    with replacing(file) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
    following = ("prices" if example == PRICES else "check", str(file))
    print_lines([f"wrote {file}; next: {shlex.join(('layoutopt', *following))}"])


def doctor(as_json: AsJson = False, jobs: Jobs = 0) -> None:
    """Try what studies need and say what is installed; exit 1 if something asks for a look."""
    from studies import doctor as examination

    found = []
    for check in examination.checks(job_count(jobs)):
        found.append(check)
        if not as_json:
            print_lines([check.line])
    if as_json:
        print(json.dumps([check.as_json() for check in found], indent=2))
    else:
        print_lines([examination.closing_line(found)])
    raise typer.Exit(0 if all(check.fine for check in found) else 1)


def cite(
    subject: Annotated[
        str, typer.Argument(help="Name of a study, or the --out folder of one; without it layoutopt alone.")
    ] = "",
    spec_file: Annotated[
        Path | None, typer.Argument(help="Spec of a study given by name; without one the built-in hospital ward.")
    ] = None,
    bibtex: Annotated[bool, typer.Option("--bibtex", help="Print entries of BibTeX.")] = False,
) -> None:
    """Say how to cite layoutopt, and the works behind the methods of a study."""
    from layoutopt import registry
    from layoutopt.journal import MANIFEST
    from studies import cited

    folder, known = Path(subject), registry.names("studies")
    if spec_file is not None and subject not in known:
        raise InvalidInput.at("layoutopt cite", "a spec goes with the name of a study", "Leave the spec out.")
    if not subject:
        methods: tuple[cited.Cited, ...] = ()
    elif subject in known:
        methods = cited.methods_of_study(subject, None if spec_file is None else spec_of(spec_file))
        if spec_file is None and not (bibtex or subject.startswith(cited.OWN_CELLS)):
            print(
                "what the built-in hospital ward asks for; of your own: layoutopt cite STUDY SPEC, or cite FOLDER"
            )
    elif (folder / MANIFEST).exists():
        methods = cited.methods_of_folder(folder)
    else:
        problem = f"{subject!r} is neither a study nor the folder of one"
        raise UnknownName.at("layoutopt cite", problem, did_you_mean(subject, known))
    print_lines(cited.cited_bibtex(methods) if bibtex else cited.cited_lines(methods))


def prices(
    file: Annotated[
        str, typer.Argument(help="Price list (TOML), or the name of one that comes along.")
    ] = "default-2026",
    as_csv: Annotated[bool, typer.Option("--csv", help="Print CSV in SI units instead of lines.")] = False,
) -> None:
    """List all items of a price list, with date and source of every price."""
    from layoutopt.prices import default_names, default_prices, read_prices
    from layoutopt.tables.prices import price_csv, price_lines

    known = default_prices(file) if file in default_names() else read_prices(file, place="layoutopt prices")
    print_lines(price_csv(known) if as_csv else price_lines(known))


def report(
    folder: Annotated[Path, typer.Argument(help="The --out folder of a finished study.")], jobs: Jobs = 0
) -> None:
    """Write tables, figures and report of a finished study anew from its journal, without any new trial."""
    from studies.rewriting import written_anew

    with attended(jobs) as by:
        answer = written_anew(folder, workers=by.workers, progress=by.progress)
    print_lines(answer.lines(folder))
    raise typer.Exit(answer.exit_code)

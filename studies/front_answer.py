"""The answer of the main study: the findings, and the spec whose site, robots and prices they speak of."""

from dataclasses import dataclass
from pathlib import Path

from layoutopt.spec.building import Spec
from layoutopt.streams import Streams
from studies import output, summary
from studies.findings import Findings


@dataclass(frozen=True, slots=True, kw_only=True)
class FrontAnswer:
    """Findings of a cost-against-accuracy study, ready to be told and written."""

    findings: Findings
    spec: Spec

    @property
    def exit_code(self) -> int:
        """Exit code of the status."""
        return self.findings.result.status.exit_code

    def lines(self, folder: Path | None) -> list[str]:
        """Return status, recommended layouts with held-out scores, and where to look."""
        written = folder if folder is not None and self.findings.result.front.members else None
        return summary.findings_lines(self.findings, written)

    def write(self, folder: Path, *, streams: Streams, quick: bool) -> None:
        """Write tables, layouts, drawings of the recommended ones, figures and report."""
        output.write_all(self.findings, self.spec, folder, streams=streams, quick=quick)

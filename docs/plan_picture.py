"""The picture of docs/plans.md, drawn of the plan and the spec that the page shows."""

import re
import tempfile
from pathlib import Path

from layoutopt.spec.reading import read_spec
from studies.effort import draw_plan

PAGE = Path(__file__).with_name("plans.md")


def draw_plan_example(pictures: Path) -> None:
    """Save the example of the page and draw it, as ``layoutopt check --picture`` does."""
    text = PAGE.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for language, file in (("json", "office.geojson"), ("toml", "office.toml")):
            first = re.search(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)
            assert first is not None, f"{PAGE} shows no {file}"
            (folder / file).write_text(first[1], encoding="utf-8")
        _, drawn = draw_plan(read_spec(folder / "office.toml"), folder / "office")
        (pictures / "plan_office.png").write_bytes(drawn.read_bytes())

"""The script of the report, and the policy by which a browser runs it and nothing else."""

from base64 import b64encode
from hashlib import sha256
from importlib import resources


def script_text() -> str:
    """Return the script as it stands within the page; no bytes of it depend on a study."""
    text = resources.files("studies").joinpath("report.js").read_text("utf-8")
    # Git may check text files out with other ends of lines; a browser takes its hash over \n.
    return text.replace("\r\n", "\n")


def content_policy() -> str:
    """Return a Content-Security-Policy: nothing is loaded, and no script runs but ours, known by its hash.

    Styles stand in the page, pictures in its SVG as data.
    """
    digest = b64encode(sha256(script_text().encode()).digest()).decode("ascii")
    return (
        f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )

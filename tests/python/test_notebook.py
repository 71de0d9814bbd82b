# SPDX-License-Identifier: MIT
"""The example notebook runs in a kernel of Jupyter, and draws its plots."""

from __future__ import annotations

from pathlib import Path

import nbclient
import nbformat
from conftest import PATIENCE

NOTEBOOK = Path(__file__).parents[2] / "examples" / "notebook" / "digitizer.ipynb"


def outputs(notebook: nbformat.NotebookNode) -> list[nbformat.NotebookNode]:
    return [output for cell in notebook.cells for output in cell.get("outputs", [])]


def test_the_notebook_runs(tmp_path: Path) -> None:
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    client = nbclient.NotebookClient(
        notebook, timeout=int(PATIENCE), resources={"metadata": {"path": str(tmp_path)}}
    )
    client.execute()  # raises if a cell does
    found = outputs(notebook)
    assert sum("image/png" in output.get("data", {}) for output in found) == 2
    texts = [output.get("text", output.get("data", {}).get("text/plain", "")) for output in found]
    assert "digitizer: status -1: -1.0 Hz is not a frequency\n" in texts
    assert "7" in texts  # requests


def test_the_notebook_is_committed_without_outputs() -> None:
    assert not outputs(nbformat.read(NOTEBOOK, as_version=4))

# SPDX-License-Identifier: MIT
"""The Python blocks of docs/python.md, which form one session, print what the document shows."""

from __future__ import annotations

import doctest
import re
from pathlib import Path
from typing import Any

import pytest

DOCUMENT = Path(__file__).parents[2] / "docs" / "python.md"


def test_the_document_shows_what_happens(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```", DOCUMENT.read_text(), re.DOTALL | re.MULTILINE)
    session: dict[str, Any] = {}
    complaints: list[str] = []
    runner = doctest.DocTestRunner(verbose=False)
    for number, block in enumerate(blocks, start=1):
        if ">>>" in block:
            name = f"block {number}"
            test = doctest.DocTestParser().get_doctest(block, session, name, str(DOCUMENT), 0)
            runner.run(test, out=complaints.append, clear_globs=False)
            session = test.globs
        else:
            exec(block, session)  # noqa: S102
    assert len(blocks) > 10
    assert not complaints, "".join(complaints)
    assert (tmp_path / "squares.png").stat().st_size > 0

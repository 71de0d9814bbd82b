# SPDX-License-Identifier: MIT
"""The reference has every public name, and each has a docstring."""

from __future__ import annotations

import inspect
import pydoc
import subprocess
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
from conftest import PROGRAMS, needs_mpf

import mpf
import mpf.ophyd

SCRIPT = Path(__file__).parents[2] / "scripts" / "python-reference"


def members(name: str, thing: object) -> Iterator[tuple[str, object]]:
    """Of a class: what it adds to the exceptions of Python."""
    yield name, thing
    if inspect.isclass(thing):
        known = dir(TimeoutError)
        for member in dir(thing):
            if not member.startswith("_") and member not in known:
                yield f"{name}.{member}", getattr(thing, member)


@pytest.mark.parametrize("module", [mpf, mpf.ophyd], ids=lambda module: module.__name__)
def test_each_public_name_has_a_docstring(module: ModuleType) -> None:
    found = [one for name in module.__all__ for one in members(name, getattr(module, name))]
    assert len(found) > len(module.__all__)
    assert [name for name, thing in found if not inspect.getdoc(thing)] == []


@pytest.mark.parametrize("client", [mpf.Client, mpf.AsyncClient])
def test_help_shows_the_arguments_of_call(client: type) -> None:
    text = pydoc.render_doc(client, renderer=pydoc.plaintext)
    assert "_call" not in text
    call = text[text.index(" call(") :].split("\n |  \n")[0]
    assert "call(self, message: " in call
    assert "retry: if the server ends before it has taken the request" in call


@needs_mpf
def test_the_package_has_the_version_of_the_programs() -> None:
    shown = subprocess.run([PROGRAMS / "mpf", "--version"], capture_output=True, text=True).stdout
    assert shown == f"mpf {mpf.__version__}\n"


def test_the_reference_has_each_public_name(tmp_path: Path) -> None:
    subprocess.run([SCRIPT, tmp_path], check=True, capture_output=True)
    text = (tmp_path / "mpf.html").read_text()
    assert [name for name in mpf.__all__ if f'id="{name}"' not in text] == []
    assert "Waits [s] for the connection" in text
    assert 'id="mpf_signal_rw"' in (tmp_path / "mpf" / "ophyd.html").read_text()

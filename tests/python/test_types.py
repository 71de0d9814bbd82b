# SPDX-License-Identifier: MIT
"""The package, and programs that use it, pass the strict checks of mypy and pyright."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import mpf
import pyvisa_mpf

PROGRAM = """
import mpf
import numpy as np

with mpf.Client("dac") as client:
    value: int = client.int32(1, address=2).value
    array = client.call(mpf.Int32(1), reply=mpf.Float64Array).value
    mean: np.floating = array.mean()
    loaned = client.loan(mpf.Float64Array, 5)
    loaned.value[:] = 0.5
    client.call(loaned, retry=True)
    requests: list[mpf.Request] = client.send_many(mpf.Int32(i) for i in range(3))
    status: int = client.call(mpf.SerialConfig(baud=9600)).status

async def configure(line: mpf.AsyncClient) -> int:
    return (await line.call(mpf.SerialConfig(baud=9600), 1.0)).status

server = mpf.Server("camera")
subscribers: list[mpf.Int32] = []
image = server.loan_shared(mpf.Float64Array, 5)
gone: list[mpf.Int32] = server.publish(image, subscribers)
"""
WRONG = """
import mpf

with mpf.Client("dac") as client:
    value: str = client.int32(1).value
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder with copies of the packages, as a type checker sees installed ones."""
    for package in (mpf, pyvisa_mpf):
        shutil.copytree(Path(package.__file__).parent, tmp_path / package.__name__)
    (tmp_path / "program.py").write_text(PROGRAM)
    settings = {
        "typeCheckingMode": "strict",
        "reportPrivateUsage": False,
        "extraPaths": sys.path,
        "pythonVersion": "3.10",
    }
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings))
    return tmp_path


def check(project: Path, *command: str) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=project, capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout + done.stderr


def test_mypy_complains_only_about_a_wrong_type(project: Path) -> None:
    (project / "wrong.py").write_text(WRONG)
    sources = ["mpf", "pyvisa_mpf", "program.py", "wrong.py"]
    status, text = check(project, "mypy", "--strict", *sources)
    assert (status, text.count("error:")) == (1, 1), text
    assert "wrong.py:5: error:" in text


def test_pyright_has_no_complaint(project: Path) -> None:
    status, text = check(project, "pyright")
    assert status == 0, text

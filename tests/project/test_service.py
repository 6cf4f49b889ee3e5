# SPDX-License-Identifier: MIT
"""The program where it is no developer's: the manual's unit of systemd, another user without a home, a package that cannot be written, locale C."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from board_runs import ROOT
from command_line import PROGRAM
from echostep.board import messages as m
from echostep.board.frames import encode
from players import babbling_port
from waiting import PATIENCE_S, ran
from walks import DEMO

MANUAL = (ROOT / "host/docs/page.md").read_text()


@pytest.mark.process
@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd-analyze is not installed")
def test_the_unit_of_the_manual_is_one(tmp_path: Path) -> None:
    (unit,) = re.findall(r"```ini\n(.*?)```", MANUAL, re.DOTALL)
    program = tmp_path / "echostep"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    path = tmp_path / "echostep.service"
    path.write_text(unit.replace("/opt/echostep/bin/echostep", str(program)))
    done = ran(["systemd-analyze", "verify", path], timeout=PATIENCE_S)
    assert "echostep.service" not in done.stdout + done.stderr, done.stdout + done.stderr


@pytest.mark.process
@pytest.mark.parametrize("home", [None, "/", "/nonexistent"])
def test_it_runs_without_a_home_in_a_narrow_terminal_of_locale_c(tmp_path: Path, home: str | None) -> None:
    """The plan's check: it reads the package's files and needs no kernel."""
    paths = os.pathsep.join(path for path in sys.path if path)
    environment = {
        "PATH": os.environ["PATH"],
        "PYTHONPATH": paths,
        "LC_ALL": "C",
        "COLUMNS": "20",
        "TMPDIR": str(tmp_path),
    }
    environment |= {} if home is None else {"HOME": home}
    command = [*PROGRAM, "plan", "check", str(DEMO)]
    done = subprocess.run(command, env=environment, cwd="/", capture_output=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == 0, done.stderr
    assert b"Traceback" not in done.stderr


def recipe(language: str) -> str:
    """The manual's only block of this language."""
    (text,) = re.findall(rf"```{language}\n(.*?)```", MANUAL, re.DOTALL)
    return str(text)


def of_the_unit() -> tuple[Path, Path, dict[str, str]]:
    """Folders for data and kernels, and the environment, that systemd makes by the unit."""
    unit = dict(line.split("=", 1) for line in recipe("ini").splitlines() if "=" in line)
    assert unit["DynamicUser"] == "yes"
    name, _, value = unit["Environment"].partition("=")
    return Path("/var/lib") / unit["StateDirectory"], Path("/var/cache") / unit["CacheDirectory"], {name: value}


def of_the_container() -> tuple[Path, Path, dict[str, str]]:
    """The same of the container; its volume lies elsewhere here."""
    lines = dict(line.split(" ", 1) for line in recipe("dockerfile").splitlines())
    assert (lines["USER"], lines["ENTRYPOINT"]) == ("1000", '["echostep"]')
    assert lines["WORKDIR"] == lines["VOLUME"]
    name, _, value = lines["ENV"].partition("=")
    folder = Path("/srv/echostep")
    kernels = Path(value.replace(lines["VOLUME"], str(folder)))
    return folder, kernels, {name: str(kernels)}


CONFINED = """
mount --make-rprivate /
for folder in {parents}; do mount -t tmpfs tmpfs "$folder" || exit 77; done
mkdir -p {folders} && chmod 777 {folders}
mount -o remount,bind,ro / || exit 77
exec unshare --user --map-user=1000 --map-group=1000 env -i {environment} sh -c '
    cd {data} && id -u && {{ touch /{marker} 2>/dev/null || echo read-only; }} && {command} && ls {data} && ls {kernels}'
"""


@pytest.mark.long
@pytest.mark.process
@pytest.mark.skipif(
    os.geteuid() != 0 or shutil.which("unshare") is None, reason="only root makes a file system read-only"
)
@pytest.mark.parametrize("given", [of_the_unit, of_the_container])
def test_it_records_as_another_user_on_a_read_only_system(
    given: Callable[[], tuple[Path, Path, dict[str, str]]],
) -> None:
    """What systemd and a container engine give: their folders alone can be written, the user is unknown and has no home."""
    data, kernels, environment = given()
    environment |= {"PATH": os.environ["PATH"], "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    identity = encode(m.Identity(0, m.SCHEMA_HASH, 1, 1, 0, 0), 0)
    with babbling_port(b"\0" + identity) as port:
        command = [*PROGRAM, "record", "--board", port, "--seconds", "1", "--out", str(data / "walk.mcap")]
        script = CONFINED.format(
            parents=" ".join(sorted({str(folder.parent) for folder in (data, kernels)} - {str(data)})),
            folders=f"{data} {kernels}", data=data, kernels=kernels, command=shlex.join(command), marker="echostep-test",
            environment=" ".join(f"{name}={shlex.quote(value)}" for name, value in environment.items()),
        )  # fmt: skip
        done = ran(["unshare", "--mount", "sh", "-c", script], timeout=PATIENCE_S)
    if done.returncode == 77:
        pytest.skip("this system lets nobody mount")
    assert done.returncode == 0, done.stdout + done.stderr
    lines = done.stdout.splitlines()
    assert lines[:2] == ["1000", "read-only"]
    assert "walk.mcap" in lines
    assert "echostep" in lines[lines.index("walk.mcap") :], "no kernels in their folder"

# SPDX-License-Identifier: MIT
"""Property tests draw the same examples everywhere and know no deadline, for the first one may compile a kernel.

Each test has its layer, by which `make quick` chooses. Needs the core alone: fixtures of the app are in `app_fixtures`.
"""

import contextlib
import os
import subprocess
import sys
from collections.abc import Generator, Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest
from hypothesis import settings

import layers

settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")
os.environ.setdefault("PYTEST_TIMEOUT", "1200")  # seconds; for pytest-timeout, where it is installed

COMPILER = Path(__file__).with_name("compile_kernels.py")
CORE, ABOVE = Path(__file__).with_name("core"), ("echostep_app", "echostep_studies")


def pytest_configure(config: pytest.Config) -> None:
    """Compile the kernels before the workers of a parallel run start, not in each of them; what fails is left to the tests."""
    if find_spec("echostep_app") and config.getoption("numprocesses", None) and not hasattr(config, "workerinput"):
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
        subprocess.run([sys.executable, COMPILER], env=environment, check=False)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks by rule."""
    for item in items:
        layers.mark(item)


@pytest.fixture(scope="session", autouse=True)
def core_alone(request: pytest.FixtureRequest) -> Iterator[None]:
    """A run of the core's tests alone has imported nothing that is built on core and simulation."""
    yield
    if all(CORE in item.path.parents for item in request.session.items):
        assert not sorted(name for name in sys.modules if name.startswith(ABOVE))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """A test that starts a process and is not marked so fails, in `make quick` and in every other run."""
    with layers.no_process() if layers.is_alone(item) else contextlib.nullcontext():
        return (yield)

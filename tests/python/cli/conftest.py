"""A small recording, and what commands made of it."""

import shutil

import pytest
from command_line import SIMULATION, run


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    """Return a folder with a recording, and what ``simulate`` said."""
    folder = tmp_path_factory.mktemp("cli") / "recording"
    return folder, run("simulate", "built-in", "-o", folder, *SIMULATION)


@pytest.fixture(scope="session")
def recording(made):
    return made[0]


@pytest.fixture(scope="session")
def reconstructed(recording, tmp_path_factory):
    out = tmp_path_factory.mktemp("cli") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("nacre.report.pictures._SIZE", (60, 60))
        patch.setattr("nacre.report.pictures._MAIN_SIZE", (60, 60))
        return out, run("reconstruct", recording, "-o", out, "--json")


@pytest.fixture
def copied(recording, tmp_path):
    """Return a copy of the recording that a test may break."""
    return shutil.copytree(recording, tmp_path / "copied")


@pytest.fixture
def no_pictures(monkeypatch):
    """Leave the pictures of the model out of the report: they take most of a short run's time."""
    monkeypatch.setattr("nacre.report.page.draw_model", lambda *_: None)

"""What the viewer's server answers."""

from __future__ import annotations

import urllib.error
import urllib.request
from http.client import HTTPResponse

import pytest

from nacre.viewer import Viewer


def ask(viewer: Viewer, path: str, **headers: str) -> HTTPResponse:
    answer: HTTPResponse = urllib.request.urlopen(urllib.request.Request(viewer.url + path, headers=headers))
    with answer:
        answer.body = answer.read()  # type: ignore[attr-defined]
    return answer


def refused(viewer: Viewer, path: str, **headers: str) -> int:
    with pytest.raises(urllib.error.HTTPError) as error:
        ask(viewer, path, **headers)
    error.value.close()
    return error.value.code

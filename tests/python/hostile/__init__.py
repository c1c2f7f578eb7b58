"""
Files from strangers: damaged and hostile files of every format that nacre reads, made here, always the same.

A case is named for what it does. What must come of it is an error of nacre's that names the file and matches
``message``; each module here has the cases of a kind of file, and ``CASES`` has all of them.

``python tests/python/hostile FOLDER`` writes them, each into a folder of its own.
"""

from hostile.cameras import CAMERAS
from hostile.case import READERS, Case, opened, write
from hostile.configs import CONFIGS
from hostile.depth_images import DEPTH_IMAGES
from hostile.meshes import MESHES
from hostile.outputs import OUTPUTS
from hostile.pcd import PCD
from hostile.phones import PHONES
from hostile.ply import PLY
from hostile.recordings import RECORDINGS
from hostile.trajectories import TRAJECTORIES

CASES = {
    case.name: case
    for cases in (
        PLY,
        PCD,
        MESHES,
        DEPTH_IMAGES,
        TRAJECTORIES,
        CAMERAS,
        CONFIGS,
        RECORDINGS,
        PHONES,
        OUTPUTS,
    )
    for case in cases
}

__all__ = ["CASES", "READERS", "Case", "opened", "write"]

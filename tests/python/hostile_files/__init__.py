"""
Files from strangers: damaged and hostile files of every format that nacre reads, made here, always the same.

A case is named for what it does. What must come of it is an error of nacre's that names the file and matches
``message``; each module here has the cases of a kind of file, and ``CASES`` has all of them.

``python tests/python/hostile_files FOLDER`` writes them, each into a folder of its own.
"""

from hostile_files.cameras import CAMERAS
from hostile_files.case import READERS, Case, opened, write
from hostile_files.checkpoints import CHECKPOINTS
from hostile_files.configs import CONFIGS
from hostile_files.depth_images import DEPTH_IMAGES
from hostile_files.meshes import MESHES
from hostile_files.outputs import OUTPUTS
from hostile_files.pcd import PCD
from hostile_files.phones import PHONES
from hostile_files.ply import PLY
from hostile_files.point_texts import POINT_TEXTS
from hostile_files.recordings import RECORDINGS
from hostile_files.ros import ROS
from hostile_files.saved_runs import SAVED_RUNS
from hostile_files.trajectories import TRAJECTORIES

CASES = {
    case.name: case
    for cases in (
        PLY,
        PCD,
        POINT_TEXTS,
        MESHES,
        DEPTH_IMAGES,
        TRAJECTORIES,
        CAMERAS,
        CONFIGS,
        RECORDINGS,
        ROS,
        PHONES,
        OUTPUTS,
        CHECKPOINTS,
        SAVED_RUNS,
    )
    for case in cases
}

__all__ = ["CASES", "READERS", "Case", "opened", "write"]

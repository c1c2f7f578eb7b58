"""Numbers that decide what a report says of a run, each with its reason."""

# A camera has inertia: from rest, a constant acceleration makes the second step three times the first.
MAX_STEP_RATIO = 3.0  # [1] of a step to the recording's motion around it
STEPS_AROUND = 3  # [steps] to each side, so that frames which flip there and back are the fewer
FLIP_ANGLE = 1.5707963  # [rad] a right angle: a camera that turned farther sees another side
MIN_STEPS = 5  # [steps] with fewer, nobody knows the recording's motion

# Five parts in a hundred of what is measured: of the distance of what is seen, or of the path's extent where
# that is larger; and the rotation that moves what is seen by as much.
MAX_POSE_ERROR = 0.05  # [1] and [rad]

# The usual level of significance.
MIN_PROBABILITY = 0.95  # [1] that a registration is right

# Nothing that a camera can have seen counts as doubled: this only leaves out a few stray points.
MAX_DOUBLED = 0.005  # [1] part of the points
SHEET_COSINE = 0.7  # [1] between normals of one sheet: 45 degrees

# Things that bend slowly showed 0.78 of it at least; the same several times as fast, 0.73 to 0.45 at the
# worst frame.
MIN_EXPLAINED = 0.75  # [1] part of the points in view that a frame shows, where the model deforms
LEAST_STRAIN = 1e-6  # [1] of a shape that is bent: less is the rounding of nodes in single precision

MIN_TRACKED = 0.5  # [1] part of the frames: the user's --min-tracked

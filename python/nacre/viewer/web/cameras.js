// The path of the camera, and where it was, as lines.

const MAX_FRUSTA = 12;
const TRUTH = [235, 235, 235];

class Lines {
  positions = [];
  colors = [];

  add(a, b, color, opacity) {
    this.positions.push(...a, ...b);
    this.colors.push(...color, opacity, ...color, opacity);
  }
}

const centerOf = (pose) => pose.map((row) => row[3]);

/** The lines of a run up to a place: its path, if it has one, the true one, and some cameras, the last larger. */
function cameraLines(run, place, statusColors, size, { path, cameras }) {
  const lines = new Lines(), frames = run.frames.slice(0, place + 1);
  const posed = frames.filter((frame) => frame.pose);
  if (path && run.hasPath) {
    chain(lines, posed.map((frame) => [centerOf(frame.pose), statusColors[frame.status]]), 150);
    chain(lines, frames.filter((frame) => frame.truth).map((frame) => [centerOf(frame.truth), TRUTH]), 60);
  }
  if (cameras && posed.length) {
    const step = Math.ceil(posed.length / MAX_FRUSTA);
    posed.forEach((frame, i) => {
      if (i % step === 0) addFrustum(lines, frame.pose, run.frustum, size, statusColors[frame.status]);
    });
    addFrustum(lines, posed.at(-1).pose, run.frustum, 2 * size, statusColors[frames.at(-1).status]);
  }
  return lines;
}

function chain(lines, positions, opacity) {
  positions.slice(1).forEach(([at, color], i) => lines.add(positions[i][0], at, color, opacity));
}

function addFrustum(lines, pose, corners, size, color) {
  const world = (p) => pose.map((row) => size * dot(row, p) + row[3]);
  const seen = corners.map(world);
  seen.forEach((corner, i) => {
    lines.add(centerOf(pose), corner, color, 220);
    lines.add(corner, seen[(i + 1) % 4], color, 220);
  });
}

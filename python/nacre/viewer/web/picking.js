// Between points and pixels of the page.

const PICK_RADIUS = 7; // [px]

/** Where a point is on the canvas, in pixels of the page; null behind the eye. */
function project(point, { view, clip }, part, canvas) {
  const [x, y, z] = seen(view, point);
  if (z >= 0) return null;
  const { middle, perUnit } = screen(clip, part, canvas);
  return [middle[0] - (perUnit * x) / z, middle[1] + (perUnit * y) / z];
}

/**
 * The shown point under a pixel, of those near it in the front surface the nearest: of which part of a cloud, and its
 * row; null where there is none. With an eye, of those that face it.
 */
function pick(whole, { view, clip }, part, canvas, x, y, eye) {
  const { middle, perUnit } = screen(clip, part, canvas);
  const found = [];
  for (const cloud of whole.parts) {
    const [right, up, back] = [0, 1, 2].map((row) => cloud.along(viewRow(view, row), view[12 + row]));
    for (let i = 0; i < cloud.size; i++) {
      const depth = -back(i);
      if (!cloud.isShown(i) || depth <= 0) continue;
      const dx = middle[0] + (perUnit * right(i)) / depth - x;
      const dy = middle[1] - (perUnit * up(i)) / depth - y;
      const distance = Math.hypot(dx, dy);
      if (distance <= PICK_RADIUS && (!eye || cloud.faces(i, eye))) found.push({ cloud, i, distance, depth });
    }
  }
  const spacing = whole.parts.reduce((least, cloud) => Math.min(least, cloud.spacing), Infinity);
  const front = found.reduce((least, point) => Math.min(least, point.depth), Infinity) + 3 * spacing;
  const surface = found.filter((point) => point.depth <= front);
  return surface.reduce((best, point) => (best && best.distance <= point.distance ? best : point), null);
}

/** A point in the frame of the eye. */
const seen = (view, point) => [0, 1, 2].map((row) => dot(viewRow(view, row), point) + view[12 + row]);

const viewRow = (view, row) => [view[row], view[4 + row], view[8 + row]];

/** The middle of a part of the canvas, and how many pixels the unit length has at a distance of 1. */
function screen(clip, part, canvas) {
  const { clientWidth: width, clientHeight: height } = canvas;
  return { middle: [(part.left + part.width / 2) * width, height / 2], perUnit: (clip[5] * height) / 2 };
}

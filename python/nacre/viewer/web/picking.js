// Between points and pixels of the page.

const PICK_RADIUS = 7; // [px]

/** Where a point is on the canvas: x and y in pixels of the page, and its depth; null behind the eye. */
function project(point, { view, clip }, part, canvas) {
  const [x, y, z] = [0, 1, 2].map(
    (row) => view[row] * point[0] + view[4 + row] * point[1] + view[8 + row] * point[2] + view[12 + row],
  );
  if (z >= 0) return null;
  const width = part.width * canvas.clientWidth;
  return [
    part.left * canvas.clientWidth + 0.5 * width * (1 - (clip[0] * x) / z),
    0.5 * canvas.clientHeight * (1 + (clip[5] * y) / z),
    -z,
  ];
}

/** The shown point under a pixel: of those near it in the front surface the nearest; -1 where there is none. */
function pick(cloud, matrices, part, canvas, x, y) {
  const found = [];
  for (let i = 0; i < cloud.size; i++) {
    if (!cloud.isShown(i)) continue;
    const at = project(cloud.position(i), matrices, part, canvas);
    if (!at) continue;
    const distance = Math.hypot(at[0] - x, at[1] - y);
    if (distance <= PICK_RADIUS) found.push({ i, distance, depth: at[2] });
  }
  const front = found.reduce((least, point) => Math.min(least, point.depth), Infinity) + 3 * cloud.spacing;
  const surface = found.filter((point) => point.depth <= front);
  return surface.reduce((best, point) => (point.distance < best.distance ? point : best), {
    i: -1, distance: Infinity,
  }).i;
}

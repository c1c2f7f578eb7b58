// What a view has in its picture.

class Frustum {
  constructor(view, clip, aspect) {
    this.rows = [0, 1, 2].map((row) => [...viewRow(view, row), view[12 + row]]);
    this.slopes = [aspect / clip[5], 1 / clip[5]]; // half the picture at a distance of 1
  }

  /** The least distance from the eye to a ball about a cube; null where the ball is outside of the picture. */
  distance(middle, side) {
    const radius = (Math.sqrt(3) / 2) * side;
    const [x, y, z] = this.rows.map(([a, b, c, d]) => a * middle[0] + b * middle[1] + c * middle[2] + d);
    const depth = -z;
    if (depth < -radius) return null;
    const isOutside = [x, y].some((value, k) => {
      const slope = this.slopes[k];
      return Math.abs(value) - slope * depth > radius * Math.hypot(1, slope);
    });
    return isOutside ? null : Math.max(Math.hypot(x, y, z) - radius, 0.01 * side);
  }
}

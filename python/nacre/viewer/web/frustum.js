// What a view has in its picture.

class Frustum {
  constructor(view, clip, aspect) {
    const [right, up, back] = [0, 1, 2].map((row) => [...viewRow(view, row), view[12 + row]]);
    const half = { x: aspect / clip[5], y: 1 / clip[5] }; // of the picture at a distance of 1
    const plane = (side, sign, slope) => side.map((value, k) => sign * value + slope * back[k]);
    this.planes = [back, ...[1, -1].flatMap((sign) => [plane(right, sign, half.x), plane(up, sign, half.y)])];
    this.eye = [0, 1, 2].map((axis) => -[right, up, back].reduce((sum, row) => sum + row[axis] * row[3], 0));
  }

  /** The least distance from the eye to a cube; null where the cube is outside of the picture. */
  distance(middle, side) {
    const half = side / 2;
    const isOutside = this.planes.some(([a, b, c, d]) => {
      const nearest = a * middle[0] + b * middle[1] + c * middle[2] + d;
      return nearest > half * (Math.abs(a) + Math.abs(b) + Math.abs(c));
    });
    if (isOutside) return null;
    const apart = this.eye.map((at, axis) => Math.max(Math.abs(at - middle[axis]) - half, 0));
    return Math.max(length(apart), 0.01 * side);
  }
}

// Vectors of three numbers, and 4 x 4 matrices by columns, as WebGL has them.

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const length = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => scaled(a, 1 / (length(a) || 1));
const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
];

/** Turn a vector about a unit axis (Rodrigues). */
function rotated(a, axis, angle) {
  const c = Math.cos(angle), s = Math.sin(angle);
  return add(add(scaled(a, c), scaled(cross(axis, a), s)), scaled(axis, dot(axis, a) * (1 - c)));
}

/** The right, up and backward axes of a camera that looks against a direction. */
function axesOf(backward, up) {
  const right = unit(cross(up, backward));
  return [right, cross(backward, right), backward];
}

function viewMatrix(eye, axes) {
  const [r, u, b] = axes;
  return [
    r[0], u[0], b[0], 0, r[1], u[1], b[1], 0, r[2], u[2], b[2], 0, -dot(r, eye), -dot(u, eye), -dot(b, eye), 1,
  ];
}

function perspective(fieldOfView, aspect, near, far) {
  const f = 1 / Math.tan(fieldOfView / 2), depth = 1 / (near - far);
  return new Float32Array([
    f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) * depth, -1, 0, 0, 2 * far * near * depth, 0,
  ]);
}

function multiply(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      for (let k = 0; k < 4; k++) out[4 * column + row] += a[4 * k + row] * b[4 * column + k];
    }
  }
  return out;
}

/** A value that a part of the values is below; of a sample of them where they are many. */
function quantile(values, part) {
  if (!values.length) return 0;
  const step = Math.ceil(values.length / 50000);
  const sample = Float64Array.from({ length: Math.ceil(values.length / step) }, (_, i) => values[i * step]).sort();
  const at = part * (sample.length - 1), low = Math.floor(at);
  return sample[low] + (at - low) * ((sample[low + 1] ?? sample[low]) - sample[low]);
}

/** A whole number with its digits in groups of three, as the report has them. */
function countText(number) {
  return String(number).replace(/\B(?=(\d{3})+$)/g, "\u202f");
}

/** A length in the unit that suits it. */
function lengthText(metres) {
  if (metres >= 1) return `${metres.toFixed(3)} m`;
  if (metres < 1e-5) return `${(1000 * metres).toFixed(3)} mm`; // less than a micrometre is rounding
  return `${(1000 * metres).toPrecision(metres >= 0.1 ? 4 : 3)} mm`;
}

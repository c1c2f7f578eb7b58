// The eye: it turns about a target, with the up direction up.

const FIELD_OF_VIEW = 0.7; // [rad]
const STEEPEST = 1.55; // elevation [rad]

class Orbit {
  constructor(canvas, onChange, onClick, onDoubleClick) {
    Object.assign(this, { target: [0, 0, 0], backward: [0, 0, -1], up: [0, -1, 0], distance: 1, touched: false });
    this.canvas = canvas;
    this.onChange = onChange;
    const pressed = new Map();
    let moved = 0, gap = 0;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      pressed.set(event.pointerId, [event.clientX, event.clientY]);
      moved = 0;
      gap = 0;
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = pressed.get(event.pointerId);
      if (!before) return;
      const now = [event.clientX, event.clientY];
      const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
      pressed.set(event.pointerId, now);
      moved += Math.abs(dx) + Math.abs(dy);
      if (moved <= 3) return;
      if (pressed.size > 1) {
        const [a, b] = [...pressed.values()];
        const wide = Math.hypot(a[0] - b[0], a[1] - b[1]);
        if (gap) this.zoom(gap / wide);
        gap = wide;
        this.move(dx / 2, dy / 2);
      } else if (event.buttons & 6 || event.shiftKey) this.move(dx, dy);
      else this.turn(dx, dy);
    });
    const release = (event) => {
      if (pressed.delete(event.pointerId) && moved <= 3 && event.button === 0) onClick(event.offsetX, event.offsetY);
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", (event) => pressed.delete(event.pointerId));
    canvas.addEventListener("dblclick", (event) => onDoubleClick(event.offsetX, event.offsetY));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(0.0015 * event.deltaY));
    }, { passive: false });
  }

  get eye() {
    return add(this.target, scaled(this.backward, this.distance));
  }

  get axes() {
    return axesOf(this.backward, this.up);
  }

  /** Look as a view of the document says, at a sphere about its target. */
  look({ target, direction, up, radius }, aspect) {
    const across = Math.min(FIELD_OF_VIEW, 2 * Math.atan(Math.tan(FIELD_OF_VIEW / 2) * aspect));
    Object.assign(this, { target, up, backward: direction, distance: radius / Math.sin(across / 2), touched: false });
    this.onChange();
  }

  turn(dx, dy) {
    const speed = 5 / this.canvas.clientHeight;
    const turned = rotated(this.backward, this.up, -speed * dx);
    const elevation = Math.asin(Math.max(-1, Math.min(1, dot(turned, this.up))));
    const wanted = Math.max(-STEEPEST, Math.min(STEEPEST, elevation + speed * dy));
    this.backward = unit(rotated(turned, axesOf(turned, this.up)[0], elevation - wanted));
    this.#changed();
  }

  move(dx, dy) {
    const [right, up] = this.axes;
    const perPixel = (2 * this.distance * Math.tan(FIELD_OF_VIEW / 2)) / this.canvas.clientHeight;
    this.target = add(this.target, add(scaled(right, -dx * perPixel), scaled(up, dy * perPixel)));
    this.#changed();
  }

  zoom(factor) {
    this.distance *= Math.min(Math.max(factor, 0.2), 5);
    this.#changed();
  }

  /** Turn about another point, from where the eye is. */
  turnAbout(point) {
    const offset = subtract(this.eye, point);
    Object.assign(this, { target: point, distance: length(offset), backward: unit(offset) });
    this.#changed();
  }

  matrices(aspect) {
    const clip = perspective(FIELD_OF_VIEW, aspect, 0.01 * this.distance, 200 * this.distance);
    return { clip, view: viewMatrix(this.eye, this.axes) };
  }

  #changed() {
    this.touched = true;
    this.onChange();
  }
}

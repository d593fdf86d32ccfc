// The camera of the page: vectors, motion, undo, and the camera as text.

export const add = (a, b) => a.map((x, i) => x + b[i]);
export const sub = (a, b) => a.map((x, i) => x - b[i]);
export const mul = (a, s) => a.map((x) => x * s);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.sqrt(dot(a, a));
export const unit = (a) => mul(a, 1 / (length(a) || 1));

// `v` rotated by `angle` around the unit vector `axis` (Rodrigues).
function turned(v, axis, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return add(add(mul(v, c), mul(cross(axis, v), s)), mul(axis, dot(axis, v) * (1 - c)));
}

// Vectors to the right, up and forward of the camera.
export function axes(camera) {
  const forward = unit(sub(camera.look_at, camera.position));
  const right = unit(cross(forward, camera.up));
  return [right, cross(right, forward), forward];
}

// Position of `point` in the picture in pixels, and its depth. null if the point is behind the
// camera.
export function project(camera, [width, height], point) {
  const [right, up, forward] = axes(camera);
  const to = sub(point, camera.position);
  const depth = dot(to, forward);
  if (depth <= 0) return null;
  const scale = height / (2 * Math.tan((camera.vertical_fov * Math.PI) / 360) * depth);
  return [width / 2 + dot(to, right) * scale, height / 2 - dot(to, up) * scale, depth];
}

const MAX_UNDO = 200;

export class Camera extends EventTarget {
  now = null;
  home = null;
  past = [];
  future = [];
  speed = 0;
  extent = 1;
  #gesture = false;

  // Sets the camera that the render reports. It is not sent back to the render.
  adopt(camera) {
    this.now = camera;
    this.#changed(false);
  }

  // Moves the camera. Moves of one gesture are undone together.
  to(camera, isGesture = false) {
    if (!this.now || JSON.stringify(camera) === JSON.stringify(this.now)) return;
    if (!(isGesture && this.#gesture)) {
      this.past.push(this.now);
      if (this.past.length > MAX_UNDO) this.past.shift();
    }
    this.#gesture = isGesture;
    this.future = [];
    this.now = camera;
    this.#changed(true);
  }

  endGesture() {
    this.#gesture = false;
  }

  undo() {
    this.#step(this.past, this.future);
  }

  redo() {
    this.#step(this.future, this.past);
  }

  #step(from, to) {
    const camera = from.pop();
    if (!camera) return;
    to.push(this.now);
    this.#gesture = false;
    this.now = camera;
    this.#changed(true);
  }

  #changed(isOwn) {
    this.dispatchEvent(new CustomEvent("change", { detail: { isOwn } }));
  }

  get distance() {
    return length(sub(this.now.look_at, this.now.position));
  }

  // Rotates the camera around its target. Angles are in radians.
  orbit(right, down) {
    const c = this.now;
    const up = unit(c.up);
    const arm = sub(c.position, c.look_at);
    let next = turned(arm, up, -right);
    const side = unit(cross(up, next));
    const tilted = turned(next, side, -down);
    // Ignore the tilt if it would move the camera over the pole
    if (length(cross(unit(tilted), up)) > 0.02) next = tilted;
    this.to({ ...c, position: add(c.look_at, next) }, true);
  }

  // Turns the camera without a change of its position. Angles are in radians.
  look(right, down) {
    const c = this.now;
    const up = unit(c.up);
    const view = turned(sub(c.look_at, c.position), up, -right);
    const tilted = turned(view, unit(cross(view, up)), -down);
    const next = length(cross(unit(tilted), up)) > 0.02 ? tilted : view;
    this.to({ ...c, look_at: add(c.position, next) }, true);
  }

  // Moves the camera parallel to the picture. Distances are fractions of the picture's height.
  pan(right, down) {
    const c = this.now;
    const size = 2 * Math.tan((c.vertical_fov * Math.PI) / 360) * this.distance;
    const [x, y] = axes(c);
    this.shift(add(mul(x, -right * size), mul(y, down * size)));
  }

  // Moves the camera and its target by a vector in scene space.
  shift(by) {
    const c = this.now;
    this.to({ ...c, position: add(c.position, by), look_at: add(c.look_at, by) }, true);
  }

  // Multiplies the distance to the target by `factor`. If the target was in focus, it stays in
  // focus.
  dolly(factor) {
    const c = this.now;
    const position = add(c.look_at, mul(sub(c.position, c.look_at), factor));
    const isFocused = Math.abs(c.focus_distance - this.distance) < 1e-3 * this.distance;
    this.to({ ...c, position, focus_distance: isFocused ? c.focus_distance * factor : c.focus_distance }, true);
  }

  // Moves the camera along its axes, in steps of the walking speed.
  walk(right, up, forward) {
    const [x, y, z] = axes(this.now);
    const step = this.extent * 0.02 * 10 ** this.speed;
    this.shift(add(add(mul(x, right * step), mul(y, up * step)), mul(z, forward * step)));
  }

  // Focuses the camera on a point in front of it.
  focusOn(point) {
    const depth = dot(sub(point, this.now.position), axes(this.now)[2]);
    if (depth > 0) this.to({ ...this.now, focus_distance: Math.fround(depth) });
  }

  get flags() {
    const c = this.now;
    const list = (v) => v.map(short).join(",");
    let flags = `--position ${list(c.position)} --look-at ${list(c.look_at)}`;
    if (c.up.join() !== "0,1,0") flags += ` --up ${list(c.up)}`;
    flags += ` --fov ${short(c.vertical_fov)}`;
    if (c.lens_radius > 0) flags += ` --lens-radius ${short(c.lens_radius)} --focus-distance ${short(c.focus_distance)}`;
    return flags;
  }

  get toml() {
    const c = this.now;
    const list = (v) => `[${v.map(float).join(", ")}]`;
    return [
      "[camera]",
      `position = ${list(c.position)}`,
      `look_at = ${list(c.look_at)}`,
      `up = ${list(c.up)}`,
      `vertical_fov = ${float(c.vertical_fov)}`,
      `lens_radius = ${float(c.lens_radius)}`,
      `focus_distance = ${float(c.focus_distance)}`,
      "",
    ].join("\n");
  }
}

// The shortest digits that represent the same 32-bit float as `x`, because the render uses 32-bit
// floats.
export function short(x) {
  const single = Math.fround(x);
  for (let digits = 1; digits < 10; digits += 1) {
    const text = Number(single.toPrecision(digits));
    if (Math.fround(text) === single) return String(text);
  }
  return String(single);
}

const float = (x) => (Number.isInteger(Number(short(x))) && !short(x).includes("e") ? `${short(x)}.0` : short(x));

// Events of mouse, touch and keys over the picture.

// Maximum motion of the pointer during a click, in pixels.
const CLICK = 4;

export function listen({ view, picture, camera, onClick, onHover, onKey }) {
  const pointers = new Map();
  let moved = 0;
  let pinch = null;
  // True if a part of the picture is outside the view. In this case two fingers move the picture,
  // not the camera.
  const isLarger = () => picture.box.w > view.clientWidth + 1 || picture.box.h > view.clientHeight + 1;
  const mode = () => document.querySelector('input[name="mode"]:checked').value;

  view.addEventListener("pointerdown", (event) => {
    if (event.button > 2) return;
    view.setPointerCapture(event.pointerId);
    view.focus({ preventScroll: true });
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (pointers.size === 1) moved = 0;
    pinch = null;
    event.preventDefault();
  });

  view.addEventListener("pointermove", (event) => {
    const last = pointers.get(event.pointerId);
    onHover(picture.pixelAt(event.clientX, event.clientY));
    if (!last || !camera.now) return;
    const [dx, dy] = [event.clientX - last[0], event.clientY - last[1]];
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (pointers.size === 2) {
      const [a, b] = [...pointers.values()];
      const now = { apart: Math.hypot(a[0] - b[0], a[1] - b[1]), at: [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2] };
      if (pinch && isLarger()) view.scrollBy(pinch.at[0] - now.at[0], pinch.at[1] - now.at[1]);
      else if (pinch) {
        const height = picture.box.h;
        camera.dolly(pinch.apart / Math.max(now.apart, 1));
        camera.pan((now.at[0] - pinch.at[0]) / height, (now.at[1] - pinch.at[1]) / height);
      }
      pinch = now;
      moved = Infinity;
      return;
    }
    const before = moved;
    moved += Math.abs(dx) + Math.abs(dy);
    if (moved <= CLICK) return;
    // Include the first pixels of a drag, which looked like a click.
    const [x, y] = before <= CLICK ? [Math.sign(dx) * moved, dy && Math.sign(dy) * Math.abs(dy)] : [dx, dy];
    const { h } = picture.box;
    const isPan = event.shiftKey || event.buttons & 4 || event.buttons & 2 || mode() === "pan";
    if (isPan) camera.pan(x / h, y / h);
    else if (mode() === "look" || event.ctrlKey) {
      const angle = (camera.now.vertical_fov * Math.PI) / 180;
      camera.look((x / h) * angle, (y / h) * angle);
    } else camera.orbit((x / h) * Math.PI, (y / h) * Math.PI);
  });

  const release = (event) => {
    const wasDown = pointers.delete(event.pointerId);
    pinch = null;
    if (pointers.size === 0 && wasDown) {
      camera.endGesture();
      const pixel = picture.pixelAt(event.clientX, event.clientY);
      if (moved <= CLICK && pixel && event.type === "pointerup" && event.button === 0) onClick(pixel);
    }
  };
  view.addEventListener("pointerup", release);
  view.addEventListener("pointercancel", release);
  view.addEventListener("pointerleave", () => onHover(null));
  view.addEventListener("contextmenu", (event) => event.preventDefault());

  let wheelEnd = 0;
  view.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      if (!camera.now) return;
      const lines = event.deltaMode === 1 ? event.deltaY * 20 : event.deltaY;
      camera.dolly(1.0015 ** Math.max(-400, Math.min(400, lines)));
      clearTimeout(wheelEnd);
      wheelEnd = setTimeout(() => camera.endGesture(), 300);
    },
    { passive: false },
  );

  // The camera moves on each animation frame while a walking key is held down.
  const WALK = {
    KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0],
  };
  const STEP = 0.08;
  const TURN = {
    ArrowLeft: () => camera.orbit(-STEP, 0), ArrowRight: () => camera.orbit(STEP, 0),
    ArrowUp: () => camera.orbit(0, -STEP), ArrowDown: () => camera.orbit(0, STEP),
    Equal: () => camera.dolly(0.9), NumpadAdd: () => camera.dolly(0.9),
    Minus: () => camera.dolly(1 / 0.9), NumpadSubtract: () => camera.dolly(1 / 0.9),
  };
  const held = new Set();
  let walking = 0;
  const step = (time) => {
    if (held.size === 0) {
      walking = 0;
      camera.endGesture();
      return;
    }
    const seconds = Math.min(0.1, (time - walking) / 1000);
    const by = [0, 0, 0];
    for (const key of held) WALK[key].forEach((x, i) => (by[i] += x));
    // Walk thirty steps per second
    camera.walk(...by.map((x) => x * 30 * seconds));
    walking = time;
    requestAnimationFrame(step);
  };
  view.addEventListener("keydown", (event) => {
    if (!camera.now || event.altKey) return;
    if (!event.ctrlKey && !event.metaKey && WALK[event.code]) {
      const wasWalking = held.size > 0;
      held.add(event.code);
      if (!wasWalking) {
        // Walk one step at once, so that a short press is one step.
        camera.walk(...WALK[event.code]);
        walking = performance.now();
        requestAnimationFrame(step);
      }
      event.preventDefault();
    } else if (TURN[event.code] && !event.ctrlKey && !event.metaKey) {
      TURN[event.code]();
      event.preventDefault();
    } else if (onKey(event)) {
      event.preventDefault();
    }
  });
  view.addEventListener("keyup", (event) => {
    held.delete(event.code);
    if (TURN[event.code]) camera.endGesture();
  });
  view.addEventListener("blur", () => held.clear());
}

// The picture on the page. Frames are converted to display colours on canvases, and the canvases
// are scaled to the view.

import { relit } from "./groups.js";
import { HALVES, shade } from "./tone.js";

// Pixels of `frame` without samples are NaN. They get the colours that `canvas` shows now, scaled
// to the size of `image`.
function keepUnknown(frame, image, canvas) {
  const { width, height } = image;
  const pixels = new Uint32Array(image.data.buffer);
  let codes = null;
  for (let i = 0; i < pixels.length; i += 1) {
    if ((frame.halves[3 * i] & 0x7fff) <= 0x7c00) continue;
    if (codes === null) {
      const scaled = document.createElement("canvas");
      [scaled.width, scaled.height] = [width, height];
      const context = scaled.getContext("2d");
      context.drawImage(canvas, 0, 0, width, height);
      codes = new Uint32Array(context.getImageData(0, 0, width, height).data.buffer);
    }
    pixels[i] = codes[i];
  }
}

export class Picture {
  look = { exposure: 0, tone: "srgb", falseColour: "", channel: "picture" };
  frame = null;
  // Content to the left of the divider: nothing (""), "kept" picture, "file", or the name of a
  // channel
  beside = "";
  kept = null;
  file = null;
  other = null;
  split = 0.5;
  // Factors of light groups by name, each with red, green and blue
  weights = new Map();
  zoom = "fit";
  // Called after the position of the picture has changed
  onPlace = () => {};
  size = [1, 1];

  constructor(view, canvas, second, overlay, divider) {
    Object.assign(this, { view, canvas, second, overlay, divider });
    new ResizeObserver(() => this.place()).observe(view);
  }

  // Channel to the left of the divider. null if the content there is not a separate channel of the
  // render.
  get secondChannel() {
    return ["", "kept", "file", this.look.channel].includes(this.beside) ? null : this.beside;
  }

  show(frame) {
    const isNew = frame.size.join() !== this.size.join();
    this.size = frame.size;
    if (frame.channel === this.secondChannel) {
      this.other = frame;
      this.repaintSecond();
    } else {
      this.frame = frame;
      this.paint(this.canvas, frame);
    }
    if (isNew) this.place();
  }

  keep() {
    this.kept = this.frame && { ...this.lit(this.frame) };
    this.repaint();
  }

  // Converts the frames again, after a change of exposure, curve, channel or light groups.
  repaint() {
    if (this.frame) this.paint(this.canvas, this.frame);
    this.repaintSecond();
  }

  repaintSecond() {
    const { beside } = this;
    const frame = beside === "kept" ? this.kept : this.secondChannel && this.other?.channel === beside ? this.other : null;
    const isShown = Boolean(beside === "file" ? this.file : frame);
    this.second.hidden = this.divider.hidden = !isShown;
    if (!isShown) return;
    if (frame) this.paint(this.second, frame);
    else {
      // A picture from a file is already encoded for display.
      [this.second.width, this.second.height] = [this.file.width, this.file.height];
      this.second.getContext("2d").drawImage(this.file, 0, 0);
    }
    this.place();
  }

  // The frame with its light groups multiplied by their weights.
  lit(frame) {
    return frame.groups?.length ? relit(frame, this.weights) : frame;
  }

  // Draws a frame on `canvas`. Pixels without samples keep their old colours, scaled to the new
  // size.
  paint(canvas, whole) {
    const frame = this.lit(whole);
    const { width, height } = frame;
    const channel = frame.channel;
    const image = new ImageData(shade(frame, { ...this.look, channel }), width, height);
    const context = canvas.getContext("2d");
    if (canvas.width > 1) keepUnknown(frame, image, canvas);
    canvas.classList.toggle("transparent", frame.backing === "transparent");
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    context.putImageData(image, 0, 0);
  }

  // Position of the picture in the view, in CSS pixels.
  get box() {
    const [width, height] = this.size;
    const { clientWidth, clientHeight } = this.view;
    const scale =
      this.zoom === "fit"
        ? Math.min(clientWidth / width, clientHeight / height)
        : Number(this.zoom) / (window.devicePixelRatio || 1);
    const [w, h] = [width * scale, height * scale];
    return { x: Math.max(0, (clientWidth - w) / 2), y: Math.max(0, (clientHeight - h) / 2), w, h, scale };
  }

  place() {
    const { x, y, w, h, scale } = this.box;
    this.view.classList.toggle("pixels", scale * (window.devicePixelRatio || 1) > 1.5);
    for (const element of [this.canvas, this.second, this.overlay, this.view.querySelector("#outline")]) {
      Object.assign(element.style, { left: `${x}px`, top: `${y}px`, width: `${w}px`, height: `${h}px` });
    }
    this.overlay.setAttribute("viewBox", `0 0 ${this.size[0]} ${this.size[1]}`);
    this.second.style.clipPath = `inset(0 ${100 * (1 - this.split)}% 0 0)`;
    Object.assign(this.divider.style, { left: `${x + w * this.split - 1}px`, top: `${y}px`, height: `${h}px` });
    this.onPlace();
  }

  // The pixel at a position in the window; null if the position is outside the picture.
  pixelAt(clientX, clientY) {
    const { left, top } = this.canvas.getBoundingClientRect();
    const { scale } = this.box;
    const [x, y] = [(clientX - left) / scale, (clientY - top) / scale];
    return x >= 0 && y >= 0 && x < this.size[0] && y < this.size[1] ? [x, y] : null;
  }

  // Values of the frame at the pixel `x`, `y` of the whole picture.
  valuesAt([x, y]) {
    if (!this.frame) return null;
    const frame = this.lit(this.frame);
    const column = Math.floor((x * frame.width) / this.size[0]);
    const row = Math.floor((y * frame.height) / this.size[1]);
    const at = 3 * (row * frame.width + column);
    return [0, 1, 2].map((c) => HALVES[frame.halves[at + c]]);
  }
}

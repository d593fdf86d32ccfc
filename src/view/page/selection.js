// The selected object: its name, and its outline drawn over the picture.

import { $, element } from "./controls.js";
import { project } from "./camera.js";
import { drawBall } from "./ball.js";

// A canvas that is opaque in the cells that show the selected object.
function maskOf({ size: [width, height], runs }) {
  const mask = document.createElement("canvas");
  [mask.width, mask.height] = [width, height];
  const context = mask.getContext("2d");
  const image = context.createImageData(width, height);
  let at = 0;
  for (const [i, count] of runs.entries()) {
    if (i % 2) for (let cell = at; cell < at + count; cell += 1) image.data[4 * cell + 3] = 255;
    at += count;
  }
  context.putImageData(image, 0, 0);
  return mask;
}

export class Selection {
  picked = null;
  #mask = null;
  // True if the next reply of the render only updates the outline of the selected object.
  #isOutline = false;

  constructor({ link, picture, camera, materials, onSelect }) {
    Object.assign(this, { link, picture, camera, materials, onSelect });
    picture.onPlace = () => this.draw();
    new MutationObserver(() => this.draw()).observe(document.documentElement, { attributeFilter: ["data-theme"] });
    document.addEventListener("keydown", ({ key }) => key === "Escape" && this.clear());
  }

  ask([x, y], isOutline = false) {
    this.#isOutline = isOutline;
    this.link.send({ do: "pick", x: Math.floor(x), y: Math.floor(y) });
  }

  // Handles the reply of the render to a request for the object at a pixel.
  answer(found) {
    const isSame = this.picked && found.object === this.picked.object && found.material === this.picked.material;
    if (this.#isOutline) {
      this.#mask = isSame ? maskOf(found.outline) : null;
      this.draw();
      return;
    }
    if (!found.material) {
      this.clear();
      this.onSelect(found);
      return;
    }
    this.picked = found;
    this.#mask = maskOf(found.outline);
    this.show();
    this.draw();
    this.onSelect(found);
  }

  // Removes the outline, which is invalid after the camera has moved.
  moved() {
    this.#mask = null;
    this.draw();
  }

  // After the camera has come to rest, requests the outline at the selected point.
  rests() {
    if (!this.picked || this.#mask || !this.camera.now) return;
    const at = project(this.camera.now, this.picture.size, this.picked.position);
    if (at && at[0] >= 0 && at[1] >= 0 && at[0] < this.picture.size[0] && at[1] < this.picture.size[1]) this.ask(at, true);
  }

  clear() {
    this.picked = this.#mask = null;
    $("selected").hidden = true;
    this.draw();
  }

  show() {
    const { object, material } = this.picked;
    const ball = element("canvas", { "aria-hidden": "true" });
    drawBall(ball, this.materials.keysOf(material), 22);
    const parts = object && object !== material ? [element("b", {}, material), element("span", {}, object)] : [element("b", {}, material)];
    $("selected").replaceChildren(ball, ...parts);
    $("selected").hidden = false;
  }

  draw() {
    const canvas = $("outline");
    canvas.hidden = !this.#mask;
    if (!this.#mask) return;
    const ratio = window.devicePixelRatio || 1;
    const { w, h } = this.picture.box;
    const [width, height] = [w, h].map((side) => Math.max(1, Math.round(Math.min(side, 4096) * ratio)));
    [canvas.width, canvas.height] = [width, height];
    const context = canvas.getContext("2d");
    const ring = (radius, colour) => {
      const layer = document.createElement("canvas");
      [layer.width, layer.height] = [width, height];
      const on = layer.getContext("2d");
      for (let i = 0; i < 16; i += 1) {
        const angle = (i * Math.PI) / 8;
        on.drawImage(this.#mask, radius * Math.cos(angle), radius * Math.sin(angle), width, height);
      }
      on.globalCompositeOperation = "source-in";
      on.fillStyle = colour;
      on.fillRect(0, 0, width, height);
      context.drawImage(layer, 0, 0);
    };
    ring(2.5 * ratio, "rgb(0 0 0 / .55)");
    ring(1.6 * ratio, getComputedStyle(document.documentElement).getPropertyValue("--accent"));
    context.globalCompositeOperation = "destination-out";
    context.drawImage(this.#mask, 0, 0, width, height);
  }
}

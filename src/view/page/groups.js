// Light groups. The page has the light of each group separately, so it can change strength and
// colour without a new render.

import { element } from "./controls.js";
import { fill } from "./fields.js";
import { HALVES, decode, toHalves } from "./tone.js";

const cache = new WeakMap();

// The frame of a picture after its light groups are multiplied by `weights`, the red, green and
// blue factors of each group.
export function relit(frame, weights) {
  const key = JSON.stringify(frame.groups.map((name) => weights.get(name) ?? [1, 1, 1]));
  const known = cache.get(frame);
  if (known?.key === key) return known.lit;
  const count = 3 * frame.width * frame.height;
  const sums = new Float32Array(count);
  for (const [k, factors] of JSON.parse(key).entries()) {
    if (factors.every((factor) => factor === 0)) continue;
    const halves = frame.halves.subarray(k * count, (k + 1) * count);
    for (let i = 0; i < count; i += 3) {
      sums[i] += factors[0] * HALVES[halves[i]];
      sums[i + 1] += factors[1] * HALVES[halves[i + 1]];
      sums[i + 2] += factors[2] * HALVES[halves[i + 2]];
    }
  }
  const lit = { ...frame, halves: toHalves(sums), groups: [] };
  cache.set(frame, { key, lit });
  return lit;
}

// Controls of each light group: strength in stops, colour, off, and solo (only this group).
export class Groups {
  names = [];
  settings = new Map();

  constructor(place, onChange) {
    Object.assign(this, { place, onChange });
  }

  // Makes the controls for the light groups `names`, if they differ from the current groups.
  build(names) {
    if (names.length === 0 || names.join("\n") === this.names.join("\n")) return;
    this.names = names;
    for (const name of names) {
      if (!this.settings.has(name)) this.settings.set(name, { stops: 0, colour: "#ffffff", isOn: true });
    }
    this.place.replaceChildren(...names.map((name) => this.control(name)));
    this.tell();
  }

  control(name) {
    const setting = this.settings.get(name);
    const isOn = element("input", { type: "checkbox", "aria-label": `${name}, on` });
    const slider = element("input", { type: "range", min: "-8", max: "8", step: "0.1", "aria-label": `${name}, stops`, "data-group": name });
    const stops = element("output", {}, "0");
    const colour = element("input", { type: "color", "aria-label": `${name}, colour` });
    const solo = element("button", { title: "This group alone, and all of them again", "aria-label": `${name} alone` }, "alone");
    const show = () => {
      [isOn.checked, slider.value, colour.value] = [setting.isOn, setting.stops, setting.colour];
      fill(slider);
      stops.textContent = `${setting.stops > 0 ? "+" : ""}${Number(setting.stops).toFixed(1)}`;
    };
    const change = (changes) => {
      Object.assign(setting, changes);
      show();
      this.tell();
    };
    isOn.addEventListener("change", () => change({ isOn: isOn.checked }));
    slider.addEventListener("input", () => change({ stops: Number(slider.value) }));
    colour.addEventListener("input", () => change({ colour: colour.value }));
    solo.addEventListener("click", () => {
      const isAlone = this.names.every((other) => this.settings.get(other).isOn === (other === name));
      for (const other of this.names) this.settings.get(other).isOn = isAlone || other === name;
      this.place.replaceChildren(...this.names.map((other) => this.control(other)));
      this.tell();
    });
    show();
    return element("div", { class: "group" }, element("label", { class: "choice" }, isOn, name), slider, stops, colour, solo);
  }

  reset() {
    this.settings.clear();
    const { names } = this;
    this.names = [];
    this.build(names);
  }

  tell() {
    const weights = new Map();
    for (const name of this.names) {
      const { stops, colour, isOn } = this.settings.get(name);
      const tint = [1, 3, 5].map((i) => decode(Number.parseInt(colour.slice(i, i + 2), 16) / 255));
      weights.set(name, tint.map((x) => (isOn ? x * 2 ** stops : 0)));
    }
    this.onChange(weights);
  }
}

// Parameters of materials as controls. The scene file's own keys name them.

import { $, copy, element } from "./controls.js";

// Ranges of sliders; other numbers are typed.
const SHARES = new Set(["roughness", "metallic", "anisotropy", "clearcoat", "clearcoat_roughness", "opacity"]);

const toCode = (x) => Math.round(255 * (x <= 0.0031308 ? 12.92 * x : Math.min(1, 1.055 * x ** (1 / 2.4) - 0.055)));
const toLinear = (code) => {
  const x = code / 255;
  return x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4;
};
const hex = (colour) => `#${colour.map((x) => toCode(Math.max(0, x)).toString(16).padStart(2, "0")).join("")}`;
const ofHex = (text) => [1, 3, 5].map((i) => Number(toLinear(Number.parseInt(text.slice(i, i + 2), 16)).toPrecision(4)));

// Keys of three numbers that are no colours.
const VECTORS = new Set(["position", "direction", "look_at", "up", "rotate"]);

// A control for a key of the scene file, which calls `send` with a value of TOML.
export function keyControl(key, value, send, attributes) {
  const words = key.replaceAll("_", " ");
  if (Array.isArray(value) && value.length === 3 && !VECTORS.has(key)) {
    // A colour picker goes to 1: what is brighter keeps its brightness.
    const strength = Math.max(1, ...value);
    const picker = element("input", { type: "color", value: hex(value.map((x) => x / strength)), "aria-label": `${words}, colour`, ...attributes });
    const text = element("input", { type: "text", value: value.join(", "), "aria-label": `${words}, linear` });
    picker.addEventListener("change", () => send(`[${ofHex(picker.value).map((x) => Number((x * strength).toPrecision(5))).join(", ")}]`));
    text.addEventListener("change", () => send(`[${text.value}]`));
    return element("label", {}, words, picker, text);
  }
  if (Array.isArray(value)) {
    const text = element("input", { type: "text", value: value.join(", "), "aria-label": words, ...attributes });
    text.addEventListener("change", () => send(`[${text.value}]`));
    return element("label", {}, words, text);
  }
  if (typeof value === "number") {
    const text = element("input", { type: "number", step: "any", value: String(value), ...attributes, "aria-label": words });
    text.addEventListener("change", () => send(text.value));
    if (!SHARES.has(key)) return element("label", {}, words, text);
    const slider = element("input", { type: "range", min: "0", max: "1", step: "0.01", "aria-label": `${words}, slider` });
    slider.value = value;
    slider.addEventListener("change", () => send(slider.value));
    return element("label", {}, words, slider, text);
  }
  const text = element("input", { type: "text", value: String(value), ...attributes, "aria-label": words });
  text.addEventListener("change", () => send(text.value));
  return element("label", {}, words, text);
}

export class Materials {
  list = [];

  constructor(link) {
    this.link = link;
    $("material").addEventListener("change", () => this.showKeys());
    for (const id of ["reset-materials", "reset-lights"]) $(id).addEventListener("click", () => link.send({ do: "reset-changes" }));
    for (const id of ["save-materials", "save-lights"]) $(id).addEventListener("click", () => link.send({ do: "save-changes" }));
    $("copy-patch").addEventListener("click", () => copy($("patch"), $("patch").value));
  }

  build(list) {
    const chosen = $("material").value;
    this.list = list;
    $("material").replaceChildren(...list.map(({ name }) => element("option", { value: name }, name)));
    if (list.some(({ name }) => name === chosen)) $("material").value = chosen;
    this.showKeys();
  }

  choose(name) {
    if (!this.list.some((material) => material.name === name)) return;
    $("material").value = name;
    this.showKeys();
  }

  showKeys() {
    const material = this.list.find(({ name }) => name === $("material").value);
    const controls = Object.entries(material?.keys ?? {}).map(([key, value]) => this.control(material.name, key, value));
    $("material-keys").replaceChildren(...controls.flat());
  }

  control(name, key, value) {
    const send = (text) => this.link.send({ do: "material", name, key, value: text });
    return keyControl(key, value, send, { "data-material": name, "data-key": key });
  }

  // `NAME.KEY=VALUE` as sections of a scene file.
  showPatches(patches) {
    const sections = new Map();
    for (const patch of patches) {
      const [, name, key, value] = patch.match(/^(.*)\.([a-z_]+)=(.*)$/s);
      const isText = !/^[[\d.+-]|^(true|false)$/.test(value);
      sections.set(name, [...(sections.get(name) ?? []), `${key} = ${isText ? JSON.stringify(value) : value}`]);
    }
    const texts = [...sections].map(([name, lines]) => `[patch.${JSON.stringify(name)}]\n${lines.join("\n")}\n`);
    $("patch").value = texts.join("\n");
  }
}

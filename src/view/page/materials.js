// Shows the materials of the scene as balls, and keys, textures and presets of the selected
// material.

import { $, copy, element } from "./controls.js";
import { drawBall } from "./ball.js";
import { nameWithKey } from "./fields.js";
import { keyControls } from "./keys.js";

// Keys for drawing the ball of a preset that the page does not know.
const UNKNOWN = { diffuse: 0.5, metallic: 0, roughness: 0.4 };

export class Materials {
  list = [];
  keys = [];
  chosen = null;
  #isOpen = false;

  constructor(link) {
    this.link = link;
    for (const id of ["reset-materials", "reset-lights"]) $(id).addEventListener("click", () => link.send({ do: "reset-changes" }));
    for (const id of ["save-materials", "save-lights"]) $(id).addEventListener("click", () => link.send({ do: "save-changes" }));
    $("copy-patch").addEventListener("click", () => copy($("patch"), $("patch").value));
    // Arrow keys select the next or previous ball.
    $("materials").addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
      if (!step) return;
      event.preventDefault();
      const at = this.list.findIndex(({ name }) => name === this.chosen);
      const next = this.list[(at + step + this.list.length) % this.list.length];
      this.choose(next.name);
      $("materials").querySelector('[aria-selected="true"]').focus();
    });
  }

  // Sets the materials `list` of the scene, all valid `keys` of a material, and `presets`.
  build(list, keys, presets) {
    Object.assign(this, { list, keys, presets });
    if (!list.some(({ name }) => name === this.chosen)) this.chosen = list[0]?.name ?? null;
    $("material-count").textContent = String(list.length);
    $("materials").replaceChildren(...list.map(({ name }) => this.#ball(name, this.keysOf(name), 46, { role: "option" }, () => this.choose(name))));
    $("presets-section").hidden = !presets.length;
    $("presets").replaceChildren(
      ...presets.map(({ name, about, keys: values }) =>
        this.#ball(name.replaceAll("-", " "), values ?? UNKNOWN, 38, { "data-preset": name, title: about ?? name }, () => this.link.send({ do: "material", name: this.chosen, key: "preset", value: name })),
      ),
    );
    this.showKeys();
  }

  #ball(words, values, side, attributes, onClick) {
    const canvas = element("canvas", { "aria-hidden": "true" });
    drawBall(canvas, values, side);
    const button = element("button", { title: words, ...attributes }, canvas, element("span", {}, words));
    button.addEventListener("click", onClick);
    return button;
  }

  // Keys for drawing the ball of a material. The base colour is multiplied by the mean colour of
  // its texture.
  keysOf(name) {
    const { keys = {}, textures = [] } = this.list.find((material) => material.name === name) ?? {};
    const mean = textures.find(({ key }) => key === "diffuse_map")?.mean;
    return mean ? { ...keys, diffuse: mean.map((x, c) => x * (keys.diffuse?.[c] ?? keys.diffuse ?? 1)) } : keys;
  }

  choose(name) {
    if (!this.list.some((material) => material.name === name)) return;
    this.chosen = name;
    this.showKeys();
    $("materials").querySelector('[aria-selected="true"]')?.scrollIntoView({ block: "nearest" });
  }

  showKeys() {
    const material = this.list.find(({ name }) => name === this.chosen);
    for (const [i, button] of [...$("materials").children].entries()) {
      const isChosen = this.list[i].name === this.chosen;
      button.setAttribute("aria-selected", String(isChosen));
      button.tabIndex = isChosen ? 0 : -1;
    }
    for (const button of $("presets").children) button.setAttribute("aria-pressed", String(button.dataset.preset === material?.keys.preset));
    $("material-name").textContent = material?.name ?? "Properties";
    const send = (key, value) => this.link.send({ do: "material", name: material.name, key, value });
    const more = { isOpen: this.#isOpen, onToggle: (isOpen) => (this.#isOpen = isOpen) };
    // Leave out the key `preset`, because presets are shown as balls.
    const keys = this.keys.filter(({ key }) => key !== "preset");
    const controls = material ? keyControls(keys, material.keys, send, { "data-material": material.name }, more) : [];
    $("material-keys").replaceChildren(...controls);
    $("textures").replaceChildren(...(material?.textures ?? []).map(texture));
  }
}

// Element with a small picture of a texture. The file of the texture can be changed only in the
// scene file.
function texture({ key, id, size }) {
  const name = nameWithKey(key);
  name.append(element("span", { class: "hint" }, `${size[0]} × ${size[1]}`));
  return element("div", { class: "texture", title: "To change a texture, edit the scene file" }, element("img", { src: `texture.png?id=${id}`, alt: `Texture ${key}`, loading: "lazy" }), name);
}

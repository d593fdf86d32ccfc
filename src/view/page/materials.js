// Parameters of materials as controls.

import { $, copy, element } from "./controls.js";
import { keyControls } from "./keys.js";

export class Materials {
  list = [];
  keys = [];
  #isOpen = false;

  constructor(link) {
    this.link = link;
    $("material").addEventListener("change", () => this.showKeys());
    for (const id of ["reset-materials", "reset-lights"]) $(id).addEventListener("click", () => link.send({ do: "reset-changes" }));
    for (const id of ["save-materials", "save-lights"]) $(id).addEventListener("click", () => link.send({ do: "save-changes" }));
    $("copy-patch").addEventListener("click", () => copy($("patch"), $("patch").value));
  }

  // The materials of the scene, and all keys that a material may have.
  build(list, keys) {
    const chosen = $("material").value;
    Object.assign(this, { list, keys });
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
    const send = (key, value) => this.link.send({ do: "material", name: material.name, key, value });
    const more = { isOpen: this.#isOpen, onToggle: (isOpen) => (this.#isOpen = isOpen) };
    const controls = material ? keyControls(this.keys, material.keys, send, { "data-material": material.name }, more) : [];
    $("material-keys").replaceChildren(...controls);
  }
}

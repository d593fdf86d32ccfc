// Lights of the scene file as controls.

import { $, copy, element } from "./controls.js";
import { keyControl } from "./materials.js";

// Keys that say which light it is, and are not changed here.
const FIXED = new Set(["type", "group", "image"]);

export class Lights {
  constructor(link) {
    this.link = link;
    $("copy-lights").addEventListener("click", () => copy($("light-edits"), $("light-edits").value));
  }

  build(lights) {
    const made = lights.map((keys, index) => {
      const send = (key) => (value) => this.link.send({ do: "light", index, key, value });
      const controls = Object.entries(keys)
        .filter(([key]) => !FIXED.has(key))
        .map(([key, value]) => keyControl(key, value, send(key), { "data-light": String(index), "data-key": key }));
      const title = `${index + 1}: ${keys.type}${keys.image ? ` ${keys.image}` : ""}${keys.group ? ` (${keys.group})` : ""}`;
      const details = element("details", { "data-title": title }, element("summary", {}, title), element("div", {}, ...controls));
      details.open = lights.length < 4;
      return details;
    });
    const none = element("p", { class: "hint" }, "The scene file has none. Materials that emit have their emission among the materials.");
    $("scene-lights").replaceChildren(...(made.length ? made : [none]));
  }

  // Changes as flags.
  showEdits(edits) {
    $("light-edits").value = edits.map((edit) => `--set '${edit}'`).join(" \\\n");
  }
}

// Hints for mouse and keys over the picture. They are shown once per browser, until the first
// action.

import { $ } from "./controls.js";

const SEEN = "embrasure.hints-seen";

// The browser may not allow storage.
const stored = (key) => {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
};
export function store(key, value) {
  try {
    localStorage.setItem(key, value);
  } catch {
    // The hints are then shown again.
  }
}
export { stored };

export class Hints {
  constructor(view) {
    for (const action of ["pointerdown", "wheel", "keydown"]) view.addEventListener(action, () => this.dismiss(), { passive: true });
    $("help").addEventListener("click", () => this.show($("hints").hidden));
  }

  // Shows the hints if they were not seen before.
  begin() {
    if (stored(SEEN) === null) this.show(true);
  }

  show(isShown) {
    $("hints").hidden = !isShown;
    $("help").setAttribute("aria-pressed", String(isShown));
  }

  dismiss() {
    if ($("hints").hidden) return;
    store(SEEN, "1");
    this.show(false);
  }
}

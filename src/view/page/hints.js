// Hints about the mouse and the keys, over the picture. A browser shows the hints only on the first
// visit, until the first action of the user.

import { $ } from "./controls.js";

const SEEN = "embrasure.hints-seen";

// Value of the browser's storage; null if the browser forbids storage.
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
    // Without storage, the hints appear again on the next visit.
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

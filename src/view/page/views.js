// Candidate cameras, each with a picture.

import { $, element } from "./controls.js";

// Name of a view for users, from its flags. "--view iso" is "Iso", and "--orbit=-30,18" is "Orbit
// −30°, 18°". Cameras with a position are numbered.
function nameOfView(flags, i) {
  if (flags.startsWith("--position")) return `Place ${i + 1}`;
  const orbit = flags.match(/^--orbit[ =]([-\d.]+),([-\d.]+)/);
  if (orbit) return `Orbit ${orbit[1].replace("-", "−")}°, ${orbit[2].replace("-", "−")}°`;
  const words = flags.replace(/^--(view )?/, "").replace(/=/g, " ");
  return words.charAt(0).toUpperCase() + words.slice(1);
}

export class Views {
  shots = [];

  constructor(link, camera) {
    Object.assign(this, { link, camera });
    $("find-views").addEventListener("click", () => {
      $("find-views").textContent = "Looking for views …";
      link.send({ do: "views" });
    });
  }

  // Shows the list of `views` without pictures. The pictures arrive later.
  build(views, size) {
    this.shots = views.map(() => element("span", { class: "shot" }));
    const buttons = views.map(({ flags, words, camera: found }, i) => {
      const button = element("button", { title: `${flags}: ${words}`, "aria-label": `View ${flags}` }, this.shots[i], element("span", { class: "caption" }, nameOfView(flags, i)));
      button.addEventListener("click", () => this.camera.to({ ...found, lens_radius: this.camera.now.lens_radius }));
      return button;
    });
    $("views").style.setProperty("--aspect", String(size[0] / size[1]));
    $("views").replaceChildren(...buttons);
    $("find-views").textContent = "Find views again";
  }

  picture({ index, image }) {
    const shot = this.shots[index];
    if (!shot) return;
    shot.classList.add("is-there");
    shot.replaceChildren(element("img", { src: `data:image/png;base64,${image}`, alt: "" }));
  }
}

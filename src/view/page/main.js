// Main script of the page. It connects the WebSocket, the picture, the camera and the controls.

import { Camera } from "./camera.js";
import { Compare } from "./compare.js";
import { $, copy, duration, element, number, tabs } from "./controls.js";
import { allow, setSlider } from "./fields.js";
import { Groups } from "./groups.js";
import { Hints, store, stored } from "./hints.js";
import { Inspector } from "./inspect.js";
import { Lights } from "./lights.js";
import { Link } from "./link.js";
import { Materials } from "./materials.js";
import { Parameters } from "./parameters.js";
import { Picture } from "./picture.js";
import { listen } from "./pointer.js";
import { Selection } from "./selection.js";
import { CURVES, idOf } from "./tone.js";
import { Views } from "./views.js";

const link = new Link();
const camera = new Camera();
const view = $("view");
const picture = new Picture(view, $("picture"), $("second"), $("overlay"), $("divider"));
const inspector = new Inspector({ link, picture, camera });
const parameters = new Parameters($("parameters"), link);
const materials = new Materials(link);
const lights = new Lights(link);
const groups = new Groups($("groups"), (weights) => {
  picture.weights = weights;
  picture.repaint();
});
// Show the second render beside the picture as soon as a comparison starts.
const compare = new Compare(link, (isOn) => setBeside(isOn ? "compared" : ""));
let tab = "camera";
const chooseTab = tabs((name) => {
  // Remove the paths if the user leaves their tab.
  if (tab === "inspect" && name !== "inspect") inspector.clear();
  tab = document.documentElement.dataset.tab = name;
});
const selection = new Selection({ link, picture, camera, materials, onSelect: showSelected });
const views = new Views(link, camera);
const hints = new Hints(view);
let status = { phase: "connecting" };
let bounds = null;
// True if the exposure of the page follows the metered exposure of the render.
let isMetered = false;

// Show the focus ring around the picture only if the user uses the keyboard.
addEventListener("keydown", () => (document.documentElement.dataset.by = "keys"));
addEventListener("pointerdown", () => delete document.documentElement.dataset.by, true);

// Use the theme of the system until the user selects another theme.
const theme = (name) => {
  document.documentElement.dataset.theme = name;
  inspector.drawSpace();
  compare.draw();
};
const THEME = "embrasure.theme";
const asked = new URLSearchParams(location.search).get("theme") ?? stored(THEME);
const dark = matchMedia("(prefers-color-scheme: dark)");
theme(asked ?? (dark.matches ? "dark" : "light"));
$("theme").addEventListener("click", () => {
  theme(document.documentElement.dataset.theme === "dark" ? "light" : "dark");
  store(THEME, document.documentElement.dataset.theme);
});

let messageEnd = 0;
function say(text, isError) {
  const message = $("message");
  message.textContent = text;
  message.classList.toggle("error", isError);
  message.hidden = false;
  clearTimeout(messageEnd);
  messageEnd = setTimeout(() => (message.hidden = true), isError ? 12000 : 4000);
}

link.addEventListener("open", () => {
  $("lost").hidden = true;
  subscribe();
});
link.addEventListener("lost", () => {
  $("lost").hidden = false;
  $("status").textContent = "not connected";
  $("loading").hidden = true;
});
$("reconnect").addEventListener("click", () => link.open());

link.addEventListener("hello", ({ detail }) => {
  const name = detail.scene.split("/").pop();
  document.title = `${name} – Embrasure`;
  $("scene").textContent = name;
  $("doing").textContent = "Rendering the first picture …";
  $("loaded").removeAttribute("value");
  $("scene").title = `${detail.scene}, ${number(detail.triangles)} triangles, lights: ${number(detail.lights)}; embrasure ${detail.version}`;
  about = `${number(detail.triangles)} triangle${detail.triangles === 1 ? "" : "s"} · ${detail.materials.length} material${detail.materials.length === 1 ? "" : "s"} · ${number(detail.lights)} light${detail.lights === 1 ? "" : "s"}`;
  hover(null);
  bounds = detail.bounds;
  camera.extent = Math.hypot(...bounds[0].map((x, i) => bounds[1][i] - x)) || 1;
  inspector.bounds = bounds;
  parameters.build(detail.tables);
  materials.build(detail.materials, detail.keys.material, detail.presets);
  if (selection.picked) selection.show();
  lights.build(detail.scene_lights, detail.keys.light);
  compare.build(detail.tables.integrators);
  const denoisers = detail.tables.groups.flatMap((group) => group.parameters).find(({ key }) => key === "denoise");
  $("denoise").replaceChildren(...denoisers.names.map((value) => element("option", { value }, value)));
  $("channel").replaceChildren(...detail.channels.map((value) => element("option", { value }, value)));
  $("channel").value = picture.look.channel;
  const sides = [["", "off"], ["kept", "the kept picture"], ["file", "the opened picture"], ["compared", "the compared render"], ...detail.channels.map((name) => [name, name])];
  $("split").replaceChildren(...sides.map(([value, words]) => element("option", { value }, words)));
  $("split").value = picture.beside;
  if (!$("tone").options.length) {
    $("tone").replaceChildren(...CURVES.map((value) => element("option", { value }, value)));
    isMetered = detail.exposure === null;
    look({ tone: detail.tone, exposure: detail.exposure ?? 0 });
  }
});

link.addEventListener("state", ({ detail }) => {
  camera.home = detail.home;
  camera.adopt(detail.camera);
  parameters.update(detail.values);
  $("patch").value = detail.patches;
  lights.showEdits(detail.light_edits, detail.light_sections);
  compare.update(detail.compare);
  const bare = detail.can_save ? "" : "a bare OBJ cannot store this; make a scene file with `embrasure init`";
  allow("save-camera", bare);
  const none = detail.patches !== "" || detail.light_edits.length > 0 ? "" : "nothing is changed";
  for (const id of ["reset-materials", "reset-lights"]) allow(id, none);
  for (const id of ["save-materials", "save-lights"]) allow(id, none || bare);
  $("copy-patch").hidden = !detail.patches;
  for (const id of ["copy-lights", "copy-light-sections"]) $(id).hidden = !detail.light_edits.length;
  if (document.activeElement !== $("noise")) $("noise").value = detail.values.noise;
  const denoise = detail.values.denoise ?? "off";
  $("denoise").value = denoise;
  // Show the denoised channel if a denoiser is on, else the noisy picture.
  if ((denoise !== "off") !== (picture.look.channel === "denoised") && ["picture", "denoised"].includes(picture.look.channel)) {
    setChannel(denoise === "off" ? "picture" : "denoised");
  }
});

link.addEventListener("camera", ({ detail }) => {
  // Ignore the camera that this page sent: the page may have moved it further since.
  if (detail.from !== link.page) camera.adopt(detail.camera);
});
link.addEventListener("page", ({ detail }) => (link.page = detail.page));

link.addEventListener("frame", ({ detail }) => {
  if (detail.groups) groups.build(detail.groups);
  if (isMetered && typeof detail.exposure === "number") setExposure(detail.exposure);
  picture.show(detail);
  if (!$("loading").hidden) {
    $("loading").hidden = true;
    document.documentElement.dataset.first = String(performance.now());
    hints.begin();
  }
  if (!detail.preview) selection.rests();
  if (detail.channel === picture.secondChannel) return;
  document.documentElement.dataset.samples = detail.preview ? "preview" : String(detail.samples);
  document.documentElement.dataset.denoised = String(detail.denoised === true);
  if (detail.denoised) document.documentElement.dataset.firstDenoised ??= String(performance.now());
});

link.addEventListener("status", ({ detail }) => {
  status = { ...status, ...detail };
  document.documentElement.dataset.phase = status.phase;
  const { phase, samples = 0, target = 1, rate = 0, seconds = 0, noise, pages } = status;
  if (phase === "loading") {
    const doing = status.doing ?? "loading the scene";
    $("doing").textContent = `${doing.charAt(0).toUpperCase()}${doing.slice(1)} …`;
    $("status").textContent = `${doing} …`;
    if (status.share > 0) $("loaded").value = status.share;
    else $("loaded").removeAttribute("value");
    return;
  }
  const part = Number.isInteger(samples) ? samples : samples.toFixed(1);
  const level = noise ? `${(100 * noise).toPrecision(2)} %` : "–";
  const names = { rendering: "Rendering", complete: "Complete", paused: "Paused" };
  $("status").textContent = `${names[phase] ?? phase} · ${part} of ${target} samples · noise ${level} · ${duration(seconds)}`;
  $("progress").value = samples / target;
  $("pause").textContent = phase === "paused" ? "Resume" : "Pause";
  const facts = [
    ["Samples per pixel", `${part} of ${target}`], ["Samples a second", number(rate)],
    ["Noise (relative error)", level],
    ["Render time", duration(seconds)], ["Open pages", pages ?? 1],
    ["Received", `${number(link.bytes / 1e6)} MB, ${link.frames} pictures`],
  ];
  $("facts").replaceChildren(...facts.flatMap(([a, b]) => [element("dt", {}, a), element("dd", {}, String(b))]));
  metered = detail.exposure ?? metered;
  if (isMetered && typeof metered === "number") setExposure(metered);
  showExposureOfRender();
});
// Metered exposure in stops that `render` would use. The page shows and applies this exposure
// rounded to hundredths of a stop.
let metered = null;
const hundredths = (stops) => Number(stops.toFixed(2));
function setExposure(stops) {
  if (hundredths(stops) !== picture.look.exposure) look({ exposure: hundredths(stops) });
}
function showExposureOfRender() {
  allow("exposure-of-render", metered === null ? "not measured yet" : hundredths(metered) === picture.look.exposure ? "in use" : "");
}

link.addEventListener("note", ({ detail }) => say(detail.text, false));
link.addEventListener("error", ({ detail }) => say(detail.text, true));
link.addEventListener("inspect", ({ detail }) => {
  chooseTab("inspect");
  inspector.show(detail.facts, bounds);
});
link.addEventListener("pick", ({ detail }) => selection.answer(detail));

// After a click, focuses on the surface or opens the controls of its material.
function showSelected(found) {
  if (!found.material) return;
  if ($("focus-click").checked) camera.focusOn(found.position);
  else if (found.is_light) chooseTab("lights");
  else {
    chooseTab("materials");
    materials.choose(found.material);
  }
}
link.addEventListener("brightest", ({ detail }) => inspector.showBrightest(detail));
link.addEventListener("errors", ({ detail }) => compare.show(detail));
link.addEventListener("views", ({ detail }) => views.build(detail.views, picture.size));
link.addEventListener("view-picture", ({ detail }) => views.picture(detail));

// Updates the controls of the camera. Moves are sent once per animation frame.
let isSending = false;
camera.addEventListener("change", ({ detail }) => {
  const c = camera.now;
  for (const [id, value] of [["fov", c.vertical_fov], ["fov-number", c.vertical_fov], ["lens", c.lens_radius], ["focus", c.focus_distance]]) {
    if (document.activeElement !== $(id)) $(id).value = Number(value.toPrecision(id === "fov-number" ? 4 : 5));
  }
  setSlider($("fov"), c.vertical_fov);
  // Positions of sliders. The maximum lens radius is a tenth of the scene's size, the maximum focus
  // distance is four times the size.
  setSlider($("lens-range"), (c.lens_radius / (0.1 * camera.extent)) ** 0.5);
  setSlider($("focus-range"), Math.log10(c.focus_distance / camera.extent) / 3.6 + 0.83);
  allow("undo", camera.past.length === 0 ? "no move yet" : "");
  allow("redo", camera.future.length === 0 ? "nothing undone" : "");
  $("copied").value = camera.toml;
  if (!detail.isOwn) return;
  document.documentElement.dataset.samples = "moving";
  selection.moved();
  if (isSending) return;
  isSending = true;
  requestAnimationFrame(() => {
    isSending = false;
    link.send({ do: "camera", ...camera.now });
  });
});
for (const [id, key] of [["fov", "vertical_fov"], ["fov-number", "vertical_fov"], ["lens", "lens_radius"], ["focus", "focus_distance"]]) {
  $(id).addEventListener("input", () => {
    const value = Number($(id).value);
    if ($(id).value !== "" && Number.isFinite(value)) camera.to({ ...camera.now, [key]: value }, true);
  });
  $(id).addEventListener("change", () => camera.endGesture());
}
for (const [id, key, toValue] of [["lens-range", "lens_radius", (x) => 0.1 * camera.extent * x * x], ["focus-range", "focus_distance", (x) => camera.extent * 10 ** (3.6 * (x - 0.83))]]) {
  $(id).addEventListener("input", () => camera.now && camera.to({ ...camera.now, [key]: Math.fround(toValue(Number($(id).value))) }, true));
  $(id).addEventListener("change", () => camera.endGesture());
}
$("speed").addEventListener("input", () => (camera.speed = Number($("speed").value)));
$("undo").addEventListener("click", () => camera.undo());
$("redo").addEventListener("click", () => camera.redo());
$("home").addEventListener("click", () => camera.to(camera.home));
$("copy-flags").addEventListener("click", () => copy($("copied"), camera.flags));
$("copy-toml").addEventListener("click", () => copy($("copied"), camera.toml));
$("save-camera").addEventListener("click", () => link.send({ do: "save-camera" }));

// Connect the buttons that control the render
$("pause").addEventListener("click", () => link.send({ do: status.phase === "paused" ? "resume" : "pause" }));
$("restart").addEventListener("click", () => link.send({ do: "restart" }));
$("noise").addEventListener("change", () => link.set("noise", $("noise").value.trim() || null));

// Changes exposure, tone curve or channel. The page applies these changes without a render.
function look(changes) {
  Object.assign(picture.look, changes);
  $("exposure-number").value = picture.look.exposure;
  setSlider($("exposure"), picture.look.exposure);
  $("tone").value = picture.look.tone;
  showExposureOfRender();
  $("save-png").href = `picture.png?exposure=${picture.look.exposure}&tone=${picture.look.tone}`;
  picture.repaint();
}
function subscribe() {
  link.send({ do: "channel", name: picture.look.channel, second: picture.secondChannel });
}
function setChannel(channel) {
  picture.look.channel = channel;
  $("channel").value = channel;
  $("tell-groups").checked = [channel, picture.secondChannel].includes("lights");
  for (const id of ["reset-groups", "save-shown"]) allow(id, $("tell-groups").checked ? "" : nothing);
  subscribe();
}
function setBeside(beside) {
  picture.beside = beside;
  $("split").value = beside;
  if (beside === "kept" && !picture.kept) picture.keep();
  if (beside === "file" && !picture.file) $("file").click();
  setChannel(picture.look.channel);
  picture.repaint();
}
for (const id of ["exposure", "exposure-number"]) {
  $(id).addEventListener("input", () => {
    isMetered = false;
    look({ exposure: Number($(id).value) || 0 });
  });
}
$("exposure-of-render").addEventListener("click", () => {
  isMetered = true;
  setExposure(metered);
});
$("meter").addEventListener("click", () => {
  // Set the exposure so that the log-average of the visible light becomes mid-grey.
  const { frame } = picture;
  if (!frame) return;
  let [sum, count] = [0, 0];
  for (let y = 0; y < frame.height; y += 4) {
    for (let x = 0; x < frame.width; x += 4) {
      const [r, g, b] = picture.valuesAt([((x + 0.5) * picture.size[0]) / frame.width, ((y + 0.5) * picture.size[1]) / frame.height]);
      const light = 0.2126 * r + 0.7152 * g + 0.0722 * b;
      if (light > 0) [sum, count] = [sum + Math.log2(light), count + 1];
    }
  }
  isMetered = false;
  if (count) look({ exposure: Number((Math.log2(0.18) - sum / count).toFixed(1)) });
});
$("tone").addEventListener("change", () => look({ tone: $("tone").value }));
$("false-colour").addEventListener("change", () => look({ falseColour: $("false-colour").value }));
$("channel").addEventListener("change", () => setChannel($("channel").value));
$("denoise").addEventListener("change", () => {
  const value = $("denoise").value;
  link.set("denoise", value === "off" ? null : value);
  setChannel(value === "off" ? "picture" : "denoised");
});
$("keep").addEventListener("click", () => {
  picture.keep();
  setBeside("kept");
});
$("split").addEventListener("change", () => setBeside($("split").value));
$("file").addEventListener("change", async () => {
  const [file] = $("file").files;
  if (!file) return;
  try {
    picture.file = await createImageBitmap(file);
    setBeside("file");
  } catch {
    say(`${file.name} cannot be shown by this browser. Open a PNG, JPEG or WebP file.`, true);
  }
});
$("split-at").addEventListener("input", () => {
  picture.split = Number($("split-at").value);
  picture.place();
});
$("tell-groups").addEventListener("change", () => setChannel($("tell-groups").checked ? "lights" : "picture"));
$("reset-groups").addEventListener("click", () => groups.reset());
$("save-shown").addEventListener("click", () => {
  $("picture").toBlob((blob) => {
    const address = URL.createObjectURL(blob);
    const save = element("a", { href: address, download: "picture.png" });
    save.click();
    setTimeout(() => URL.revokeObjectURL(address), 1000);
  });
});
$("zoom").addEventListener("change", () => {
  picture.zoom = $("zoom").value;
  picture.place();
  inspector.drawOver();
});
let isDividing = false;
$("divider").addEventListener("pointerdown", (event) => {
  isDividing = true;
  $("divider").setPointerCapture(event.pointerId);
  event.stopPropagation();
});
$("divider").addEventListener("pointermove", (event) => {
  if (!isDividing) return;
  const { left, width } = $("picture").getBoundingClientRect();
  picture.split = Math.min(1, Math.max(0, (event.clientX - left) / width));
  $("split-at").value = picture.split;
  picture.place();
});
$("divider").addEventListener("pointerup", () => (isDividing = false));

// Text below the picture while the pointer is outside the picture.
let about = "";
function hover(at) {
  const values = at && picture.valuesAt(at);
  const isId = picture.frame?.channel === "id";
  $("pixel").textContent = values
    ? `${Math.floor(at[0])}, ${Math.floor(at[1])}   ${picture.frame.channel}  ${isId ? idOf(values) : values.map((v) => number(v, 4)).join("  ")}`
    : about;
}

function key(event) {
  const isCommand = event.ctrlKey || event.metaKey;
  const actions = {
    KeyZ: isCommand && (() => (event.shiftKey ? camera.redo() : camera.undo())),
    KeyY: isCommand && (() => camera.redo()),
    KeyP: !isCommand && (() => $("pause").click()),
    KeyR: !isCommand && (() => $("restart").click()),
    KeyF: !isCommand && (() => $("focus-click").click()),
    Home: () => camera.to(camera.home),
    BracketLeft: () => look({ exposure: picture.look.exposure - 0.5 }),
    BracketRight: () => look({ exposure: picture.look.exposure + 0.5 }),
  };
  const action = actions[event.code];
  if (action) action();
  return Boolean(action);
}

// A click in the tab of paths requests the paths of the pixel. In other tabs it selects the object.
const click = (at) => (tab === "inspect" && !$("focus-click").checked ? inspector.ask(at) : selection.ask(at));
listen({ view, picture, camera, onClick: click, onHover: hover, onKey: key });
for (const slider of document.querySelectorAll('input[type="range"]')) setSlider(slider, slider.value);
const nothing = "groups are not separated";
for (const id of ["reset-groups", "save-shown"]) allow(id, nothing);
link.open();

// Objects for tests, and for users who try the browser console.
Object.assign(window, { embrasure: { link, camera, picture, inspector, groups, compare, materials, selection, hints } });

// Draws a material as a ball in a small studio, from the material's keys and without the render.
// The ball only approximates the material.

import { ofHex } from "./keys.js";

const unit = (v) => {
  const length = Math.hypot(...v);
  return v.map((x) => x / length);
};
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const mix = (a, b, t) => a + (b - a) * t;
const smooth = (from, to, x) => {
  const t = Math.min(1, Math.max(0, (x - from) / (to - from)));
  return t * t * (3 - 2 * t);
};
const encode = (x) => (x <= 0.0031308 ? 12.92 * Math.max(x, 0) : Math.min(1, 1.055 * x ** (1 / 2.4) - 0.055));

// Lamps: direction of the middle, cosine of the angle between middle and edge, radiance
const LAMPS = [
  [unit([-0.55, 0.72, 0.55]), 0.9, 5],
  [unit([0.93, 0.25, 0.2]), 0.93, 2.6],
  [unit([-0.75, -0.1, -0.65]), 0.9, 1.2],
];

// Light of the studio from the direction `way`, blurred by `blur`: a dark floor, a bright ceiling,
// and the lamps.
function studio(way, blur) {
  const wide = 0.03 + 0.55 * blur;
  let light = mix(0.1, 0.75, smooth(-0.25 - wide, 0.6 + wide, way[1]));
  for (const [to, edge, radiance] of LAMPS) {
    const spread = (1 - edge) / (1 - edge + 0.6 * blur * blur);
    light += radiance * (0.15 + 0.85 * spread) * smooth(edge - wide, edge + 0.4 * (1 - edge), dot(way, to)) * (blur > 0.6 ? 0.8 : 1);
  }
  return light;
}

// Irradiance of a matte surface with the normal `n`.
const irradiance = (n) => 0.42 + 0.22 * n[1] + LAMPS.reduce((sum, [to, , radiance]) => sum + 0.16 * radiance * Math.max(0, dot(n, to)), 0);

// A colour of a scene file as three linear numbers. A missing colour is `usual`.
function three(value, usual) {
  if (Array.isArray(value)) return value;
  if (typeof value === "string") return /^#[0-9a-f]{6}$/i.test(value) ? ofHex(value) : [0.5, 0.5, 0.5];
  return Array(3).fill(value ?? usual);
}

// Parameters for drawing the ball, computed from the material's keys.
function looks(keys) {
  const diffuse = three(keys.diffuse, 0);
  const specular = three(keys.specular, 0);
  const metal = keys.metallic ?? 0;
  const hasFacets = keys.model === "ggx" || keys.metallic !== undefined || keys.roughness !== undefined;
  const rough = hasFacets ? (keys.roughness ?? 0.5) : keys.exponent !== undefined ? (2 / (keys.exponent + 2)) ** 0.25 : 0;
  const index = keys.ior ?? 1.5;
  const dielectric = ((index - 1) / (index + 1)) ** 2;
  let facing = specular;
  let grows = keys.model === "mirror" || keys.model === "ggx" || keys.model === "blinn";
  if (keys.eta !== undefined && keys.k !== undefined) {
    const [eta, k] = [three(keys.eta, 1), three(keys.k, 0)];
    facing = eta.map((n, c) => (((n - 1) ** 2 + k[c] ** 2) / ((n + 1) ** 2 + k[c] ** 2)) * (keys.specular === undefined ? 1 : specular[c]));
  } else if (keys.metallic !== undefined) {
    facing = diffuse.map((base) => mix(dielectric, base, metal));
    grows = true;
  } else if (keys.ior !== undefined && grows) facing = specular.map((factor) => factor * dielectric);
  const transmission = three(keys.transmission, 0);
  if (Math.max(...transmission) > 0 && Math.max(...facing) === 0) [facing, grows] = [[dielectric, dielectric, dielectric], true];
  return {
    diffuse: diffuse.map((x) => x * (1 - metal)), facing, grows, rough, transmission, index: keys.thin ? 1 : index,
    emission: three(keys.emission, 0), coat: keys.clearcoat ?? 0, coatRough: keys.clearcoat_roughness ?? 0,
    sheen: three(keys.sheen, 0), opacity: keys.opacity ?? 1,
  };
}

// Light of the studio through a ball of glass, at the point with the normal `n`. The light is
// refracted twice, and the image is upside down.
function through(n, index, blur) {
  const cos = n[2];
  const sin = Math.sqrt(Math.max(0, 1 - cos * cos)) / index;
  const turn = 2 * (Math.acos(Math.min(1, cos)) - Math.asin(Math.min(1, sin)));
  const side = Math.hypot(n[0], n[1]) || 1;
  const bend = Math.sin(turn);
  return studio([(-n[0] / side) * bend, (-n[1] / side) * bend, -Math.cos(turn)], blur);
}

// Draws the ball into `canvas`, with a width of `side` CSS pixels.
export function drawBall(canvas, keys, side = 46) {
  const size = Math.round(side * (window.devicePixelRatio || 1));
  [canvas.width, canvas.height] = [size, size];
  const m = looks(keys);
  const context = canvas.getContext("2d");
  const image = context.createImageData(size, size);
  const radius = size / 2 - 1;
  for (let y = 0; y < size; y += 1) {
    for (let x = 0; x < size; x += 1) {
      const [u, v] = [(x + 0.5 - size / 2) / radius, (size / 2 - y - 0.5) / radius];
      const out = Math.hypot(u, v);
      const cover = Math.min(1, Math.max(0, (1 - out) * radius + 0.5));
      if (cover === 0) continue;
      const scale = out > 0.999 ? 0.999 / out : 1;
      const n = [u * scale, v * scale, Math.sqrt(Math.max(0, 1 - (out * scale) ** 2))];
      const back = [2 * n[2] * n[0], 2 * n[2] * n[1], 2 * n[2] * n[2] - 1];
      const edge = (1 - n[2]) ** 5;
      const matte = irradiance(n);
      const shine = studio(back, m.rough);
      const coat = m.coat > 0 ? m.coat * (0.04 + 0.96 * edge) * studio(back, m.coatRough) : 0;
      const seen = m.transmission.some((t) => t > 0) ? through(n, m.index, m.rough) : 0;
      const checker = (Math.floor((4 * x) / size) + Math.floor((4 * y) / size)) % 2 ? 0.35 : 0.6;
      for (let c = 0; c < 3; c += 1) {
        const facing = m.facing[c];
        const reflected = facing > 0 ? (m.grows ? facing + (1 - facing) * edge * (1 - m.rough) : facing) : 0;
        let light = m.diffuse[c] * matte + reflected * shine + coat + m.transmission[c] * seen * (1 - reflected);
        light += m.sheen[c] * (1 - n[2]) ** 3 * matte + m.emission[c] / (1 + Math.max(...m.emission));
        light = mix(checker, light, m.opacity);
        image.data[4 * (y * size + x) + c] = 255 * encode(0.85 * light);
      }
      image.data[4 * (y * size + x) + 3] = 255 * cover;
    }
  }
  context.putImageData(image, 0, 0);
}

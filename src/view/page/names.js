// Names of keys and parameters for users, and slider ranges for numbers without a maximum.

const NAMES = {
  // Parameters of a render
  samples: "Samples per pixel", seed: "Random seed", sampler: "Sampler", denoise: "Denoiser", denoise_radius: "Denoiser radius",
  noise: "Noise level", width: "Width", height: "Height", filter: "Pixel filter", filter_radius: "Filter radius", background: "Background",
  integrator: "Integrator", max_depth: "Maximum bounces", roulette_depth: "Roulette from bounce", roulette: "Roulette rule",
  directions: "Ray directions", direction_points: "Direction points", direction_perturbation: "Point perturbation",
  direction_scrambling: "Point scrambling", direct: "Direct light", mis: "MIS heuristic", light_selection: "Light selection",
  lamp_samples: "Samples per lamp", triangle_sampling: "Lamp sampling", reuse: "Path reuse", clamp_indirect: "Firefly clamp",
  light_samples: "Light samples", emission_coin: "Emission coin", emission_probability: "Emission chance", absorption: "Absorption",
  direct_probability: "Direct light chance", branching: "Rays per bounce", tree_depth: "Tree depth", ao_distance: "Occlusion distance",
  photons: "Photons", photon_radius: "Photon radius", photon_alpha: "Radius reduction", photon_count: "Photons per estimate",
  gather_rays: "Gather rays", cache_error: "Cache error", cache_rays: "Cache rays", debug_view: "Debug view",
  metropolis_direct: "Direct light of chains", metropolis_target: "Target of chains", chains: "Chains", bootstrap: "Start samples",
  large_step_probability: "Large steps", mutation_size: "Small step size",
  // Materials
  preset: "Preset", diffuse: "Base colour", specular: "Reflection", model: "Reflection model", exponent: "Shininess", roughness: "Roughness",
  metallic: "Metal", anisotropy: "Brushed", anisotropy_rotation: "Brush direction", clearcoat: "Clear coat",
  clearcoat_roughness: "Coat roughness", sheen: "Sheen", eta: "Metal index", k: "Metal extinction", transmission: "Transparency",
  ior: "Refractive index", abbe: "Dispersion (Abbe)", absorption_depth: "Absorption depth", thin: "Thin dielectric", emission: "Glow",
  opacity: "Opacity", camera_visible: "Seen by the camera", patch: "Patch",
  diffuse_map: "Base colour texture", specular_map: "Reflection texture", emission_map: "Glow texture", exponent_map: "Shininess texture",
  roughness_map: "Roughness texture", metallic_map: "Metal texture", opacity_map: "Opacity texture", bump_map: "Bump texture", normal_map: "Normal map",
  displacement_map: "Displacement texture",
  // Lights
  type: "Type", group: "Light group", position: "Position", intensity: "Intensity", direction: "Direction", look_at: "Aims at", angle: "Angle",
  falloff: "Soft edge from", irradiance: "Irradiance", radiance: "Brightness", image: "Picture", scale: "Strength", rotate: "Rotation",
  sun: "Sun", turbidity: "Haze", up: "Up", front: "Front", size: "Size", radius: "Radius",
};

// Range of a slider: minimum, maximum, and true for logarithmic steps.
const RANGES = {
  samples: [1, 4096, true], max_depth: [0, 64, true], roulette_depth: [0, 32], width: [16, 4096, true], height: [16, 4096, true],
  denoise_radius: [1, 10], branching: [1, 16], tree_depth: [1, 16], light_samples: [1, 64, true], photons: [1000, 1e7, true], photon_count: [2, 1024, true],
  cache_rays: [16, 16384, true], filter_radius: [0.5, 8],
  exponent: [1, 10000, true], ior: [1, 3], abbe: [10, 90], anisotropy_rotation: [-180, 180], absorption_depth: [0.001, 1000, true],
  falloff: [0, 90], scale: [0.01, 100, true], front: [-180, 180], radius: [0.001, 1000, true],
};

const UNITS = { anisotropy_rotation: "°", falloff: "°", angle: "°", front: "°", width: "px", height: "px" };

// Name of a key for users. If the table has no name for the key, the name is the key with spaces in
// place of underscores.
export const nameOf = (key) => NAMES[key] ?? key.charAt(0).toUpperCase() + key.slice(1).replaceAll("_", " ");
export const isNamed = (key) => key in NAMES;
export const usualRange = (key) => RANGES[key];
export const unitOf = (key) => UNITS[key];

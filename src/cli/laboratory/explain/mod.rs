//! `embrasure explain`: the parameters of a material, the scattering of its lobes, plots, and a
//! rendered sphere.
//!
//! `polar` draws the plots as SVG, `terminal` as text.

mod polar;
mod terminal;

use crate::bsdf::Bsdf;
use crate::cli::args::ExplainArgs;
use crate::cli::error::{CliError, INTERRUPTED};
use crate::cli::info::decimal;
use crate::cli::job::read_scene;
use crate::cli::outputs::{Outputs, face_error};
use crate::cli::printing;
use crate::cli::progress::{InterruptGuard, Progress};
use crate::color::{Spectrum, Tone};
use crate::files::Output;
use crate::io::{ExrFormat, FileError, Format};
use crate::light::LightId;
use crate::lint::{
    DeltaDirection, LobeAlbedo, LobeProfile, PREVIEW_CAMERA, Profile, albedos, direction_at, directional_albedo,
    preview_scene,
};
use crate::material::{Map, Material, MaterialId};
use crate::math::UVec2;
use crate::render::Outcome;
use crate::scene::{Instance, Scene, SceneBuilder};
use crate::scene_file::{Inspection, MaterialSource, inspect_scene};
use crate::session::{Session, Settings, all_threads, thread_pool};
use crate::texture::Texture;
use serde_json::{Value, json};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use strsim::levenshtein;

/// Maximum number of names that an error suggests.
const MAX_SUGGESTED: usize = 5;
/// Names of a lobe's albedos: for a viewer along the normal, for a viewer at 60° to the normal, and
/// for uniform light from all sides.
const VIEWS: [&str; 3] = ["normal", "60_degrees", "uniform_light"];
/// Angles of the viewer in plots, in degrees from the normal.
const INCIDENCES: [f32; 4] = [0.0, 30.0, 60.0, 80.0];
/// Number of points per degree of a curve in a plot. Narrow lobes need this resolution at their
/// peaks.
const FINE: u32 = 8;
/// Angles of the viewer, in degrees, at which the albedo is computed: multiples of `ALBEDO_STEP`
/// below 90, and `GRAZING`.
const ALBEDO_STEP: usize = 5;
const GRAZING: f32 = 89.0;
/// Maximum computed albedo of a material that conserves energy: 1 plus the error of the integral.
const MAX_ALBEDO: f32 = 1.004;

/// Explains one material of a scene.
pub(in crate::cli) fn explain(args: &ExplainArgs) -> Result<ExitCode, CliError> {
    // Invalid settings are rejected before any file is read.
    let settings = Settings {
        resolution: UVec2::from(args.size),
        spp: args.spp.get(),
        threads: args.threads.unwrap_or_else(all_threads),
        ..Settings::default()
    };
    settings.check()?;
    let mut outputs = Outputs::default();
    let is_plot = |path: &&PathBuf| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("svg"));
    let (plots, images): (Vec<_>, Vec<_>) = args.output.iter().partition(is_plot);
    let images: Vec<PathBuf> = images.into_iter().cloned().collect();
    let images = outputs.prepare_images(&images, Tone::default(), &ExrFormat::default())?;
    if images.has_faces() {
        return Err(face_error(
            "the picture is not a cube map",
            "give a name without the placeholder",
        ));
    }
    let plots = plots
        .into_iter()
        .map(|path| outputs.prepare("-o", path))
        .collect::<Result<Vec<_>, _>>()?;
    outputs.refuse_inputs([&*args.scene])?;
    let pool = thread_pool(settings.threads)?;
    let file = read_scene(&args.scene, &args.load)?;
    let inspection = pool.install(|| inspect_scene(&file, SceneBuilder::new()));
    let Inspection {
        scene,
        findings,
        materials,
        textures,
        files,
        ..
    } = inspection;
    outputs.refuse_inputs(files.iter().map(PathBuf::as_path))?;
    if let Some(error) = findings.first_error() {
        return Err(error.clone().into());
    }
    let Some(scene) = scene else {
        return Err(file.whole("there is no scene").into());
    };
    let mut found = materials
        .iter()
        .zip(scene.materials())
        .enumerate()
        .filter(|(_, (s, _))| s.name == args.material);
    let Some((index, (source, material))) = found.next() else {
        return Err(unknown(args, &file.whole(""), &materials).into());
    };
    if found.next().is_some() {
        printing::warning(
            "several OBJ files of the scene have a material of this name; the first of these materials is shown",
        );
    }

    let mut facts = facts(&scene, &textures, MaterialId(index as u32), source, material);
    let bsdf = material.bsdf();
    let albedos = pool.install(|| albedos_by_angle(&bsdf));
    facts["albedo_by_angle"] = albedos
        .iter()
        .map(|(angle, a)| json!({ "degrees": angle, "albedo": a.to_array().map(four_digits) }))
        .collect();
    let profiles = |fineness| INCIDENCES.map(|incidence| Profile::new(&bsdf, incidence, fineness));
    if args.json && args.plots {
        facts["profiles"] = profiles(1).iter().map(profile).collect();
    }
    if args.json {
        outln!("{facts:#}")
    } else {
        print_text(&facts);
        print_albedos(&albedos);
        if args.plots {
            terminal::print(&profiles(FINE));
        }
    }
    for output in plots {
        let picture = polar::svg(&material.name, &profiles(FINE), &albedos);
        output.write(|writer| writer.write_all(picture.as_bytes()))?;
    }
    if images.is_empty() {
        Ok(ExitCode::SUCCESS)
    } else {
        portray(settings, material, scene.textures(), &images, args.quiet)
    }
}

/// Albedo of all lobes together, for several angles of the viewer. Each entry has the angle in
/// degrees first.
fn albedos_by_angle(bsdf: &Bsdf) -> Vec<(f32, Spectrum)> {
    let angles = (0..90).step_by(ALBEDO_STEP).map(|angle| angle as f32).chain([GRAZING]);
    angles
        .map(|angle| (angle, directional_albedo(bsdf, direction_at(angle))))
        .collect()
}

/// All numbers of a profile as JSON.
fn profile(profile: &Profile) -> Value {
    let lobe = |lobe: &LobeProfile| {
        let delta = |delta: &DeltaDirection| json!({ "degrees": delta.angle, "share": delta.share.to_array() });
        json!({
            "name": lobe.name,
            "f_cos": lobe.value.iter().map(|value| value.to_array()).collect::<Vec<_>>(),
            "pdf": lobe.pdf,
            "directions": lobe.deltas.iter().map(delta).collect::<Vec<_>>(),
        })
    };
    json!({
        "incidence_degrees": profile.incidence,
        "degrees": profile.angles,
        "lobes": profile.lobes.iter().map(lobe).collect::<Vec<_>>(),
        "total": lobe(&profile.total),
    })
}

/// Prints the albedos at some angles, and reports whether energy is conserved.
fn print_albedos(albedos: &[(f32, Spectrum)]) {
    let shown = albedos.iter().filter(|(angle, _)| INCIDENCES.contains(angle));
    let shown: Vec<String> = shown
        .map(|(angle, albedo)| format!("{angle}° {:.3}", albedo.luminance()))
        .collect();
    outln!("  {:<13} {}", "albedo", shown.join(", "));
    let largest = albedos
        .iter()
        .max_by(|a, b| a.1.max_component().total_cmp(&b.1.max_component()));
    if let Some((angle, albedo)) = largest {
        let max = albedo.max_component();
        let energy = if max <= MAX_ALBEDO { "kept" } else { "GAINED" };
        outln!(
            "  {:<13} {energy}: at most {max:.3} of the light is scattered, at a viewing angle of {angle}°",
            "energy"
        );
    }
}

/// `value` rounded to four decimals.
fn four_digits(value: f32) -> f64 {
    (f64::from(value) * 1e4).round() / 1e4
}

/// Error for an unknown material, with the most similar names.
fn unknown(args: &ExplainArgs, whole: &FileError, materials: &[MaterialSource]) -> FileError {
    let mut names: Vec<&str> = materials.iter().map(|m| m.name.as_str()).collect();
    let wanted = args.material.to_lowercase();
    names.sort_by_cached_key(|name| (levenshtein(&name.to_lowercase(), &wanted), name.to_string()));
    names.dedup();
    names.truncate(MAX_SUGGESTED);
    let error = FileError {
        message: format!("no face of the scene uses a material `{}`", args.material),
        ..whole.clone()
    };
    error.help(format!("the nearest names are {}", names.join(", ")))
}

/// All reported properties of a material.
fn facts(scene: &Scene, files: &[PathBuf], id: MaterialId, source: &MaterialSource, material: &Material) -> Value {
    let place = source
        .place
        .as_ref()
        .map(|(file, position)| FileError::new(file, "").at(*position).place());
    let texture = |(key, map): (&str, Option<Map>)| {
        let map = map?;
        let index = map.texture.0 as usize;
        let (width, height) = scene.textures().get(index)?.size();
        let file = files.get(index).map(|file| file.display().to_string());
        Some((
            key.strip_suffix("_map").unwrap_or(key).to_string(),
            json!({ "file": file, "width": width, "height": height }),
        ))
    };
    let textures: serde_json::Map<String, Value> = material.maps.by_key().into_iter().filter_map(texture).collect();
    let shapes = scene
        .geom_ids()
        .zip(scene.meshes())
        .filter(|(geom, _)| scene.shape(*geom).material == id);
    let (mut triangles, mut power) = (0, 0.0);
    for (geom, mesh) in shapes {
        // A prototype has the meshes that several instances share. Each instance has separate
        // lights for these meshes. Their ids begin with `first_light` of the instance.
        let of_prototype = |i: &&Instance| {
            scene
                .prototypes()
                .get(i.prototype as usize)
                .is_some_and(|p| p.contains(&geom.0))
        };
        let bases: Vec<u32> = if scene.world_meshes().contains(&geom.0) {
            vec![0]
        } else {
            scene
                .instances()
                .iter()
                .filter(of_prototype)
                .map(|i| i.first_light.0)
                .collect()
        };
        triangles += mesh.triangles.len() * bases.len();
        let Some(LightId(first)) = scene.shape(geom).first_light else {
            continue;
        };
        for base in bases {
            let lights = scene.lights().iter().skip((base + first) as usize);
            power += lights
                .take(scene.shape(geom).light_count as usize)
                .map(|light| light.power(1.0))
                .sum::<f64>();
        }
    }
    json!({
        "name": material.name,
        "defined": place,
        "triangles": triangles,
        "diffuse": colour(material.diffuse),
        "specular": colour(material.specular),
        "gloss": material.gloss.to_string(),
        "roughness": material.uses_roughness().then(|| number(material.roughness)),
        "transmission": colour(material.transmission),
        "ior": number(material.ior),
        "thin": material.thin,
        "opacity": number(material.opacity),
        "emission": colour(material.emission),
        "power_w": power,
        "textures": textures,
        "lobes": albedos(&material.bsdf()).iter().map(lobe).collect::<Vec<_>>(),
    })
}

fn lobe(lobe: &LobeAlbedo) -> Value {
    let albedo = VIEWS.iter().zip(lobe.albedo.map(|a| a.to_array().map(four_digits)));
    let probability = VIEWS.iter().zip(lobe.probability.map(four_digits));
    let value = |(name, values): (&str, Vec<f32>)| {
        let values: Vec<f64> = values.into_iter().map(number).collect();
        let value = if let [single] = values[..] {
            json!(single)
        } else {
            json!(values)
        };
        (name.to_string(), value)
    };
    json!({
        "name": lobe.lobe.name(),
        "parameters": lobe.lobe.parameters(),
        "values": lobe.lobe.values().into_iter().map(value).collect::<serde_json::Map<_, _>>(),
        "delta": lobe.lobe.is_delta(),
        "albedo": albedo.map(|(view, a)| (view.to_string(), json!(a))).collect::<serde_json::Map<_, _>>(),
        "probability": probability.map(|(view, p)| (view.to_string(), json!(p))).collect::<serde_json::Map<_, _>>(),
    })
}

fn colour(value: Spectrum) -> [f64; 3] {
    decimal(value.to_array())
}

fn number(value: f32) -> f64 {
    decimal([value; 3])[0]
}

/// A value as text for users.
fn text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(values) => format!("[{}]", values.iter().map(text).collect::<Vec<_>>().join(", ")),
        Value::Number(number) if number.is_f64() => number.as_f64().map_or_else(String::new, printing::number),
        value => value.to_string(),
    }
}

fn print_text(facts: &Value) {
    let defined = facts["defined"]
        .as_str()
        .unwrap_or("not in a file: the default material");
    outln!("{} ({defined})", text(&facts["name"]));
    for key in [
        "triangles",
        "diffuse",
        "specular",
        "gloss",
        "roughness",
        "transmission",
        "ior",
        "thin",
        "opacity",
        "emission",
    ] {
        if !facts[key].is_null() {
            outln!("  {key:<13} {}", text(&facts[key]));
        }
    }
    outln!("  {:<13} {} W from all its triangles", "power", text(&facts["power_w"]));
    for (slot, map) in facts["textures"].as_object().into_iter().flatten() {
        outln!(
            "  {:<13} {slot}: {}, {}x{} texels",
            "texture",
            text(&map["file"]),
            map["width"],
            map["height"]
        );
    }
    for lobe in facts["lobes"].as_array().into_iter().flatten() {
        outln!("  lobe {}: {}", text(&lobe["name"]), text(&lobe["parameters"]));
        for view in VIEWS {
            let probability = lobe["probability"][view].as_f64();
            let chosen = probability.map_or_else(String::new, |p| {
                format!(", chosen with probability {}", printing::number(p))
            });
            outln!(
                "    {:<13} albedo {}{chosen}",
                view.replace('_', " "),
                text(&lobe["albedo"][view])
            );
        }
    }
}

/// Renders the material preview: a sphere of `material`.
fn portray(
    settings: Settings,
    material: &Material,
    textures: &[Texture],
    outputs: &[(Format, Output)],
    quiet: bool,
) -> Result<ExitCode, CliError> {
    let builder = settings.chosen_integrator().scene_builder();
    let scene = preview_scene(builder, material, textures).map_err(|e| CliError::Failed(e.to_string()))?;
    let session = Session::new(scene, PREVIEW_CAMERA, settings)?;
    let renderer = session.renderer()?;
    let samples = session.settings().crop().area() * u64::from(session.settings().spp);
    let progress = Progress::new(samples, quiet);
    let _interrupts = InterruptGuard::begin();
    let mut state = renderer.start();
    let outcome = renderer.render(&mut state, &progress);
    progress.finish();
    let metadata = renderer.metadata(&state, outcome == Outcome::Complete);
    let image = renderer.develop(&state);
    for (format, output) in outputs {
        output.write_image(format, &image, None, &metadata)?;
    }
    Ok(match outcome {
        Outcome::Complete => ExitCode::SUCCESS,
        Outcome::Stopped => ExitCode::from(INTERRUPTED),
    })
}

//! `embrasure info`: contents of a scene.

use super::args::{RenderArgs, SceneArgs};
use super::error::CliError;
use super::job::{guess_picture, guesses, read_scene};
use super::printing;
use crate::geometry::{Mesh, PartNames};
use crate::guess::position_text;
use crate::io::Warning;
use crate::light::LightId;
use crate::material::{Material, MaterialId};
use crate::math::{DVec3, Vec3};
use crate::scene::{Ground, LampSize, PartSize, Scene, SceneBuilder};
use crate::scene_file::{LightType, LoadedScene, load_scene};
use crate::session::{
    CameraSettings, FoundCamera, LitWords, Memory, Settings, all_threads, camera_and_lit, thread_pool,
};
use serde_json::{Map, Value, json};
use std::cmp::Reverse;
use std::process::ExitCode;

/// Maximum number of parts in the text. JSON lists all parts.
const MAX_PARTS: usize = 100;
/// Maximum number of lamps in the text. JSON lists all lamps.
const MAX_LAMPS: usize = 20;

/// Prints the contents of a scene.
pub(super) fn info(args: &SceneArgs) -> Result<ExitCode, CliError> {
    let mut file = read_scene(&args.scene, &args.load)?;
    let camera = CameraSettings::of(&file);
    let origin = file.origin();
    file.change_light(args.light.changes(), &camera.viewpoint());
    let LoadedScene {
        mut scene,
        mut warnings,
        ..
    } = load_scene(&file, SceneBuilder::new())?;
    guess_picture(&RenderArgs::default(), &mut file);
    let mut settings = Settings::of(&file);
    settings.guesses = guesses(&file, &file.options);
    let pool = thread_pool(all_threads())?;
    // If no camera sees the scene, the other properties are still printed.
    let found = camera_and_lit(&file, &settings, (&scene, &warnings), &pool).ok();
    let (camera, lit) = found.map_or((None, None), |(camera, lit)| (Some(camera), lit));
    let guess = lit.as_ref().and_then(|lit| lit.words.clone());
    let geometry = Geometry::of(&scene);
    if let Some(lit) = lit {
        file = lit.file;
        // Only one of the two scenes is in memory at a time.
        drop(scene);
        LoadedScene { scene, warnings, .. } = load_scene(&file, SceneBuilder::new())?;
    }
    let added = scene.triangle_count().saturating_sub(geometry.triangles);
    let bounds = scene.bounds();
    let memory = Memory::new(&scene, &settings);
    // The kinds of lights in scene files, and the emitting triangles of meshes
    let kinds = LightType::names().into_iter().chain(["triangle"]);
    let of_kind = |kind: &str| scene.lights().iter().filter(|light| light.kind() == kind).count();
    let count: Map<String, Value> = kinds.map(|kind| (kind.into(), json!(of_kind(kind)))).collect();
    let groups = scene.light_groups();
    let members = |group: usize| (0..scene.lights().len()).filter(move |&id| groups.of(LightId(id as u32)) == group);
    let (parts, names) = (scene.part_sizes(), scene.part_names());
    let of_ground = scene
        .ground()
        .map(|ground| scene.shape(ground.geom()).material.0 as usize);
    let is_of_file = |(id, _): &(usize, &Material)| Some(*id) != of_ground;
    let mut info = json!({
        "scene": args.scene.display().to_string(),
        "meshes": geometry.meshes,
        "triangles": geometry.triangles,
        "added_triangles": added,
        "instances": geometry.instances,
        "placed_triangles": geometry.placed_triangles,
        "moves": scene.is_moving(),
        "panes": scene.panes(),
        "vertices": geometry.vertices,
        "materials": scene.materials().iter().enumerate().filter(is_of_file).map(|(_, m)| json!({
            "name": m.name,
            "diffuse": decimal(m.diffuse.to_array()),
            "specular": decimal(m.specular.to_array()),
            "gloss": m.gloss.to_string(),
            "transmission": decimal(m.transmission.to_array()),
            "ior": m.ior,
            "thin": m.thin,
            "emission": decimal(m.emission.to_array()),
        })).collect::<Vec<_>>(),
        "lights": count,
        "light_guess": guess.as_ref().and_then(LitWords::light),
        "ground_guess": guess.as_ref().and_then(LitWords::ground),
        "lamps": lamps(&scene),
        "light_groups": groups.names().iter().enumerate().map(|(group, name)| json!({
            "name": name,
            "lights": members(group).count(),
        })).collect::<Vec<_>>(),
        "camera": camera.map(|FoundCamera { description, guess, .. }| {
            let parameters = &description.parameters;
            json!({
                "position": in_file(parameters.position, origin),
                "look_at": in_file(parameters.look_at, origin),
                "up": decimal(parameters.up.to_array()),
                "vertical_fov": decimal([parameters.vertical_fov; 3])[0],
                "lens_radius": decimal([parameters.lens_radius; 3])[0],
                "focus_distance": decimal([parameters.focus_distance; 3])[0],
                "resolution": settings.resolution.to_array(),
                "guess": guess.as_ref().map(|guess| &guess.words),
                "flags": guess.as_ref().map(|guess| guess.flags(origin)),
            })
        }),
        "bounds": [in_file(bounds.min, origin), in_file(bounds.max, origin)],
        "origin": origin.to_array(),
        "memory_forecast_bytes": {
            "scene": memory.scene,
            "bvh": memory.acceleration,
            "film": memory.film,
            "peak": memory.peak(),
        },
        "warnings": warnings.iter().map(|w| &w.text).collect::<Vec<_>>(),
    });
    // A file may have as many parts as faces, so JSON values are made only if they are printed.
    if args.json {
        let values = parts.iter().map(|part| {
            json!({
                "name": Some(names.name(part.part)).filter(|name| !name.is_empty()),
                "triangles": part.triangles,
                "area": decimal_of(part.area),
                "bounds": [in_file(part.bounds.min, origin), in_file(part.bounds.max, origin)],
            })
        });
        info["parts"] = values.collect();
        outln!("{info:#}");
    } else {
        print_text(&info, (&parts, names, origin), &warnings);
    }
    Ok(ExitCode::SUCCESS)
}

/// Numbers of the geometry of a scene without the ground.
struct Geometry {
    meshes: usize,
    triangles: u64,
    vertices: usize,
    instances: usize,
    placed_triangles: u64,
}

impl Geometry {
    fn of(scene: &Scene) -> Self {
        let ground = scene.ground().map(|ground| mesh_of(scene, ground));
        let triangles = ground.map_or(0, |mesh| mesh.triangles.len() as u64);
        let vertices = scene.meshes().iter().map(|mesh| mesh.positions.len()).sum::<usize>();
        Self {
            meshes: scene.meshes().len() - usize::from(ground.is_some()),
            triangles: scene.triangle_count() - triangles,
            vertices: vertices - ground.map_or(0, |mesh| mesh.positions.len()),
            instances: scene.instances().len(),
            placed_triangles: scene.placed_triangle_count() - triangles,
        }
    }
}

fn mesh_of<'a>(scene: &'a Scene, ground: &Ground) -> &'a Mesh {
    &scene.meshes()[ground.geom().0 as usize]
}

/// Emitting surfaces of each material, sorted by decreasing power.
fn lamps(scene: &Scene) -> Vec<Value> {
    let mut lamps: Vec<_> = scene.lamp_sizes().into_iter().collect();
    lamps.sort_by(|(_, a), (_, b)| b.power.total_cmp(&a.power));
    let value = |(id, lamp): (MaterialId, LampSize)| {
        json!({
            "material": scene.materials()[id.0 as usize].name,
            "lights": lamp.lights,
            "area": decimal_of(lamp.area),
            "power": decimal_of(lamp.power),
        })
    };
    lamps.into_iter().map(value).collect()
}

/// The `f32` values as `f64` with the shortest decimals that restore each `f32`. A plain conversion
/// to `f64` would print seventeen digits.
pub(super) fn decimal(values: [f32; 3]) -> [f64; 3] {
    values.map(|v| v.to_string().parse().unwrap_or(v as f64))
}

/// `value` rounded to the digits of an `f32`, because it is a sum of products of `f32`.
fn decimal_of(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

/// OBJ coordinates of `p`. `origin` is the scene's origin in OBJ coordinates.
pub(super) fn in_file(p: Vec3, origin: DVec3) -> [f64; 3] {
    position_text(p, origin).map(|x| x.parse().unwrap_or(f64::NAN))
}

fn print_text(info: &Value, (parts, names, origin): (&[PartSize], &PartNames, DVec3), warnings: &[Warning]) {
    let text = |v: &serde_json::Value| v.as_str().map_or_else(|| v.to_string(), str::to_string);
    let megabytes = |v: &serde_json::Value| v.as_u64().unwrap_or(0) as f64 / 1e6;
    outln!("{}", text(&info["scene"]));
    outln!("  meshes     {}", info["meshes"]);
    let added = match info["added_triangles"].as_u64() {
        None | Some(0) => String::new(),
        Some(count) => format!(" (a render adds {count} for the ground or the guessed lamp)"),
    };
    outln!("  triangles  {}{added}", info["triangles"]);
    outln!("  vertices   {}", info["vertices"]);
    if info["instances"].as_u64() != Some(0) {
        outln!(
            "  instances  {}, with {} triangles in all",
            info["instances"],
            info["placed_triangles"]
        );
    }
    if let Some(words) = printing::panes(info["panes"].as_u64().unwrap_or(0)) {
        outln!("  glass      {words}");
    }
    outln!("  bounds     {} to {}", info["bounds"][0], info["bounds"][1]);
    let camera = &info["camera"];
    if camera.is_object() {
        let focus = match camera["lens_radius"].as_f64() {
            Some(radius) if radius > 0.0 => {
                format!(
                    ", lens radius {radius}, in focus at a distance of {}",
                    camera["focus_distance"]
                )
            }
            _ => String::new(),
        };
        outln!(
            "  camera     at {} towards {}, vertical field of view {} degrees in a picture of {}x{}{focus}",
            camera["position"],
            camera["look_at"],
            camera["vertical_fov"],
            camera["resolution"][0],
            camera["resolution"][1]
        );
        if let (Some(words), Some(flags)) = (camera["guess"].as_str(), camera["flags"].as_str()) {
            outln!("             guessed: {words}");
            outln!("             {flags}");
        }
    }
    let lights = &info["lights"];
    let kinds = lights
        .as_object()
        .into_iter()
        .flatten()
        .filter(|(_, n)| n.as_u64() != Some(0));
    let kinds: Vec<String> = kinds.map(|(kind, n)| format!("{n} {kind}")).collect();
    outln!("  lights     {}", kinds.join(", "));
    let lamps = info["lamps"].as_array().map_or(&[][..], Vec::as_slice);
    let power = |lamp: &Value| lamp["power"].as_f64().unwrap_or(0.0);
    let total: f64 = lamps.iter().map(power).sum();
    for lamp in lamps.iter().take(MAX_LAMPS) {
        let lights = printing::count(lamp["lights"].as_u64().unwrap_or(0), "light");
        let percent = if total > 0.0 { 100.0 * power(lamp) / total } else { 0.0 };
        outln!(
            "             {}: {lights}, area {}, power {} ({percent:.1} % of the lamps)",
            text(&lamp["material"]),
            lamp["area"],
            lamp["power"]
        );
    }
    if lamps.len() > MAX_LAMPS {
        let count = lamps.len() - MAX_LAMPS;
        outln!("             and {count} more, none of them with more power (--json lists all)");
    }
    if let Some(words) = info["light_guess"].as_str() {
        outln!("             guessed: {words}");
    }
    if let Some(words) = info["ground_guess"].as_str() {
        outln!("  ground     guessed: {words}");
    }
    for group in info["light_groups"].as_array().into_iter().flatten() {
        let lights = group["lights"].as_u64().unwrap_or(0);
        outln!(
            "  group      {}: {}",
            text(&group["name"]),
            printing::count(lights, "light")
        );
    }
    let memory = &info["memory_forecast_bytes"];
    outln!(
        "  memory     scene {:.1} MB, acceleration structure about {:.1} MB, film {:.1} MB; about {:.0} MB at the peak of a render",
        megabytes(&memory["scene"]),
        megabytes(&memory["bvh"]),
        megabytes(&memory["film"]),
        megabytes(&memory["peak"])
    );
    outln!("  materials");
    for m in info["materials"].as_array().into_iter().flatten() {
        outln!(
            "    {}: diffuse {}, specular {} ({}), transmission {} (ior {}), emission {}",
            text(&m["name"]),
            m["diffuse"],
            m["specular"],
            text(&m["gloss"]),
            m["transmission"],
            m["ior"],
            m["emission"]
        );
    }
    if !parts.is_empty() {
        outln!("  parts");
    }
    for part in largest(parts) {
        let name = names.name(part.part);
        let name = if name.is_empty() { "(no name)" } else { &*name };
        let triangles = printing::count(part.triangles, "triangle");
        let middle = in_file(part.bounds.center(), origin).map(printing::measured);
        outln!(
            "    {name}: {triangles}, area {}, middle {}",
            Value::from(decimal_of(part.area)),
            middle.join(",")
        );
    }
    if parts.len() > MAX_PARTS {
        let count = parts.len() - MAX_PARTS;
        outln!("    and {count} more, none of them with more triangles (--json lists all)");
    }
    for warning in warnings {
        let kind = if warning.is_note() { "note" } else { "warning" };
        outln!("  {kind}: {warning}");
    }
}

/// The [`MAX_PARTS`] parts with the most triangles, in the order of the file. Among parts with
/// equally many triangles, the first are chosen.
fn largest(parts: &[PartSize]) -> Vec<&PartSize> {
    let mut order: Vec<usize> = (0..parts.len()).collect();
    if parts.len() > MAX_PARTS {
        order.select_nth_unstable_by_key(MAX_PARTS, |&part| (Reverse(parts[part].triangles), part));
        order.truncate(MAX_PARTS);
        order.sort_unstable();
    }
    order.into_iter().map(|part| &parts[part]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Bounds3;

    #[test]
    fn largest_and_first_parts_are_chosen() {
        let part = |triangles| PartSize {
            triangles,
            part: 0,
            area: 0.0,
            bounds: Bounds3::EMPTY,
        };
        let mut parts: Vec<PartSize> = (0..300).map(|_| part(1)).collect();
        parts[299] = part(7);
        let chosen = largest(&parts);
        assert_eq!(chosen.len(), MAX_PARTS);
        assert!(std::ptr::eq(chosen[98], &parts[98]) && std::ptr::eq(chosen[99], &parts[299]));
        assert_eq!(largest(&parts[..3]).len(), 3);
    }
}

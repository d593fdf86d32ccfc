//! Text of a commented scene file for a bare OBJ (`embrasure init`). It has all values that a
//! render of the OBJ uses, and each material as a patch in comments.

use super::mtl::MapRequest;
use super::option_section::OptionSection;
use super::write::{absolute, relocated};
use super::{FileError, Inspection, LightSection, MaterialSection, MaterialSource, SceneFile, SceneOptions};
use crate::camera::CameraDescription;
use crate::io::DEFAULT_LIGHT;
use crate::math::Glob;
use crate::options::{IntegratorOptions, SamplingOptions, SizeOptions, ToneOptions};
use std::collections::BTreeMap;
use std::path::Path;

/// Maximum number of material names that a comment lists.
const MAX_NAMED: usize = 20;

/// Comments that are written above the first section of each kind.
const COMMENTS: [(&str, &str); 5] = [
    (
        "[camera]",
        "Camera: position of the lens, point in the middle of the image, and up direction; vertical_fov in degrees.\n\
         A lens_radius above 0 blurs everything that is not at the focus_distance.",
    ),
    (
        "[image]",
        "Picture: size in pixels. Exposure in stops (each doubles the light) and tone curve (srgb, reinhard,\n\
         aces-narkowicz, aces-hill, agx) apply to PNG files; EXR files hold linear light.",
    ),
    ("[render]", "Samples per pixel: four times as many halve the noise."),
    (
        "[[object]]",
        "Geometry. Placement: transform = { translate = [0, 0, 0], rotate = [0, 0, 0], scale = 1 }",
    ),
    (
        "[[light]]",
        "Lights in addition to emitting materials. `embrasure help scene` lists their types.",
    ),
];

impl SceneFile {
    /// Text of a commented scene file that will be written to `path`. The new file renders the same
    /// image as this scene with `options` and `camera`. `inspection` is the result of inspecting
    /// this scene.
    ///
    /// # Errors
    ///
    /// An invalid patch, or a file name that is not UTF-8.
    pub fn template(
        &self,
        options: &SceneOptions,
        camera: &CameraDescription,
        inspection: &Inspection,
        path: &Path,
    ) -> Result<String, FileError> {
        let mut file = self.with(&explicit(options), camera)?;
        let is_unlit = inspection.findings.iter().any(|finding| finding.code == DEFAULT_LIGHT);
        if is_unlit && file.light.is_empty() {
            file.light.push(LightSection::default_light());
        }
        let source = self.whole("").file;
        let source = source.file_name().unwrap_or_default().to_string_lossy();
        let mut text = comment(&format!(
            "Scene file of {source}, written by embrasure {} init. It gives the same picture as the bare OBJ with the same flags.",
            env!("CARGO_PKG_VERSION")
        ));
        text +=
            &comment("Lines such as `#seed = 0` are settings at their current value: delete the # and change them.");
        text += &comment("`embrasure help scene` lists all keys.");
        let usual = usual_settings(options);
        for line in file.to_toml(path)?.lines() {
            if let Some((_, words)) = COMMENTS
                .iter()
                .find(|(header, _)| line == *header && !text.contains(&format!("\n{header}\n")))
            {
                words.lines().for_each(|words| text += &comment(words));
            }
            text += line;
            text.push('\n');
            if line == "[render]" {
                text += &usual;
            }
        }
        text.push('\n');
        text += &comment(
            "Materials with their current values. A patch changes only its own keys; its name may be a pattern,",
        );
        text += &comment(
            "such as [patch.\"Metal*\"]. Colours are linear, one number or three; a texture multiplies the key of its name.",
        );
        let folder = absolute(path.parent().unwrap_or(Path::new("")));
        for (id, material) in inspection.materials.iter().enumerate() {
            text.push('\n');
            text += &file.material_text(material, triangles(inspection, id), &folder)?;
        }
        text += &unused(inspection);
        Ok(text)
    }

    /// Text of a material as a patch in comments. `triangles` is the number of triangles that use
    /// the material.
    fn material_text(&self, source: &MaterialSource, triangles: usize, folder: &Path) -> Result<String, FileError> {
        let name = source.name.as_str();
        let plural = if triangles == 1 { "" } else { "s" };
        let place = source.place.as_ref().map_or(String::new(), |(file, position)| {
            format!(
                ", {}:{}",
                file.file_name().unwrap_or_default().to_string_lossy(),
                position.line
            )
        });
        let mut text = comment(&format!("{name}: {triangles} triangle{plural}{place}"));

        let path = |request: &MapRequest| {
            let found = request.path.as_ref()?;
            Some(relocated(found, Path::new(""), folder))
        };
        let section = MaterialSection::of(&source.found, &path);
        for request in source.found.maps.iter().filter(|request| request.path.is_none()) {
            text += &comment(&format!("Its texture {} is missing.", request.statement.file));
        }
        // Use a spelling of the glob that no patch of the file has, because TOML rejects repeated
        // keys
        let glob = Glob::exact(name);
        let spellings = (0..=self.patch.0.len()).map(|copy| glob.text(copy));
        let is_free = |spelling: &String| self.patch.0.iter().all(|(known, _)| known.get_ref() != spelling);
        let name = { spellings }.find(is_free).unwrap_or_else(|| name.into());
        let settings = toml::to_string(&BTreeMap::from([("patch", BTreeMap::from([(name, section)]))]));
        let settings = settings.map_err(|error| self.unwritable(&error))?;
        for line in settings.lines().filter(|line| !line.is_empty() && *line != "[patch]") {
            text += &format!("#{line}\n");
        }
        Ok(text)
    }

    fn unwritable(&self, error: &toml::ser::Error) -> FileError {
        let error = self.whole(format!("cannot write its scene file: {error}"));
        error.help("rename the files of the scene: their names must be UTF-8")
    }
}

/// Copy of `options` for the file. Values that users usually change first are written even if they
/// are defaults.
fn explicit(options: &SceneOptions) -> SceneOptions {
    let (size, tone) = (options.size, options.tone);
    SceneOptions {
        size: SizeOptions {
            width: Some(size.width()),
            height: Some(size.height()),
        },
        tone: ToneOptions {
            exposure: Some(tone.exposure()),
            tone: Some(tone.tone()),
        },
        sampling: SamplingOptions {
            samples: options
                .sampling
                .samples
                .or(has_no_quality(options).then(|| options.sampling.samples())),
            ..options.sampling
        },
        ..*options
    }
}

/// Returns true if no option `quality` sets the samples and the denoiser.
fn has_no_quality(options: &SceneOptions) -> bool {
    options.quality.quality.is_none()
}

/// Comments with frequent settings of `[render]` and their default values.
fn usual_settings(options: &SceneOptions) -> String {
    let (sampling, integrator) = (&options.sampling, &options.integrator);
    let sampling = SamplingOptions {
        seed: sampling.seed.is_none().then(|| sampling.seed()),
        denoise: (sampling.denoise.is_none() && has_no_quality(options)).then(|| sampling.denoise()),
        ..SamplingOptions::default()
    };
    let integrator = IntegratorOptions {
        integrator: integrator.integrator.is_none().then(|| integrator.integrator()),
        max_depth: integrator.max_depth.is_none().then(|| integrator.max_depth()),
        ..IntegratorOptions::default()
    };
    let section = OptionSection::of(&[&sampling, &integrator]);
    // Writing names and numbers cannot fail
    let text = toml::to_string(&section).unwrap_or_default();
    text.lines().map(|line| format!("#{line}\n")).collect()
}

/// Number of triangles that use the material `id`. Triangles of a mesh with several copies count
/// once.
fn triangles(inspection: &Inspection, id: usize) -> usize {
    let Some(scene) = &inspection.scene else { return 0 };
    let of_material = scene
        .geom_ids()
        .filter(|&geom| scene.shape(geom).material.0 as usize == id);
    of_material
        .map(|geom| scene.meshes()[geom.0 as usize].triangles.len())
        .sum()
}

/// Comment with the names of materials that libraries define and no face uses.
fn unused(inspection: &Inspection) -> String {
    let is_unused = |name: &&String| inspection.materials.iter().all(|material| material.name != **name);
    let defined = inspection
        .objs
        .iter()
        .flat_map(|obj| &obj.materials)
        .map(|(name, ..)| name);
    let names: Vec<&str> = defined.filter(is_unused).map(String::as_str).collect();
    if names.is_empty() {
        return String::new();
    }
    let rest = if names.len() > MAX_NAMED { ", …" } else { "" };
    let named: Vec<&str> = names.into_iter().take(MAX_NAMED).collect();
    format!(
        "\n{}",
        comment(&format!(
            "Defined, but not used by any face: {}{rest}",
            named.join(", ")
        ))
    )
}

/// Comment line with the text `words`. Control characters are replaced, because they are invalid in
/// TOML comments.
fn comment(words: &str) -> String {
    let shown: String = words
        .chars()
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .collect();
    format!("# {shown}\n")
}

use super::{FileError, Position};
use crate::color::Spectrum;
use crate::material::Material;
use std::path::{Path, PathBuf};

/// Diffuse reflectance of a surface whose material says nothing about it.
const DEFAULT_DIFFUSE: f32 = 0.8;

/// The material of faces that have none.
pub(super) fn default_material(name: &str) -> Material {
    Material {
        name: name.into(),
        diffuse: Spectrum::splat(DEFAULT_DIFFUSE),
        emission: Spectrum::ZERO,
    }
}

/// The materials of an MTL file, in its order.
pub(super) fn load_mtl(path: &Path) -> Result<Vec<Material>, FileError> {
    let bytes = std::fs::read(path).map_err(|e| FileError::system(path, "cannot read the material library", &e))?;
    let text = complete_colors(path, &String::from_utf8_lossy(&bytes))?;
    let (materials, _) = tobj::load_mtl_buf(&mut text.as_bytes()).map_err(|error| blame_line(path, &text, &error))?;
    materials.iter().map(|m| convert(path, m)).collect()
}

/// Writes greys, which MTL allows as a single number, as three numbers; tobj takes nothing less without a panic.
fn complete_colors(path: &Path, text: &str) -> Result<String, FileError> {
    let mut lines = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            [key @ ("Ka" | "Kd" | "Ks" | "Ke"), grey] => lines.push(format!("{key} {grey} {grey} {grey}")),
            ["Ka" | "Kd" | "Ks" | "Ke"] | ["Ka" | "Kd" | "Ks" | "Ke", _, _] => {
                let message = format!("`{}` is no colour", line.trim());
                let error = FileError::new(path, message).at(Position::line(i + 1));
                return Err(error.help("give one number or three"));
            }
            _ => lines.push(line.to_string()),
        }
    }
    Ok(lines.join("\n"))
}

/// The first line that the parser refuses when it stands alone.
fn blame_line(path: &Path, text: &str, error: &tobj::LoadError) -> FileError {
    let refused = |line: &str| tobj::load_mtl_buf(&mut format!("newmtl m\n{line}").as_bytes()).is_err();
    let found = text.lines().enumerate().find(|(_, line)| refused(line));
    let blame = FileError::new(path, error.to_string()).help("correct the line; colours are three numbers");
    match found {
        Some((i, line)) => FileError {
            message: format!("{error}: `{}`", line.trim()),
            ..blame.at(Position::line(i + 1))
        },
        None => blame,
    }
}

fn convert(path: &Path, m: &tobj::Material) -> Result<Material, FileError> {
    let emission = m.emissive.map_or(Spectrum::ZERO, Spectrum::from);
    // A material that names any colour means the others to be black; one that names none is a plain surface.
    let names_a_color = m.specular.is_some() || !emission.is_black() || m.unknown_param.contains_key("Tf");
    let diffuse = match m.diffuse {
        Some(kd) => Spectrum::from(kd),
        None if names_a_color => Spectrum::ZERO,
        None => Spectrum::splat(DEFAULT_DIFFUSE),
    };
    for (key, value) in [("Kd", diffuse), ("Ke", emission)] {
        if !value.is_valid() {
            let message = format!(
                "material `{}`: {key} is {:?}, but every channel must be a finite number, 0 or more",
                m.name,
                value.to_array()
            );
            return Err(FileError::new(path, message).help(format!("correct {key} in this file")));
        }
    }
    Ok(Material {
        name: m.name.clone(),
        diffuse,
        emission,
    })
}

/// Where a library named in an OBJ file lies: relative to the OBJ's folder.
pub(super) fn library_path(obj: &Path, name: &str) -> PathBuf {
    obj.parent().unwrap_or(Path::new("")).join(name)
}

//! Checks of the parts of a scene, and the range of coordinates that backends can trace.
//!
//! Coordinates beyond 10¹⁰ are errors. Scenes less than 10⁻⁹ units wide are also errors. Both rules
//! apply to world space and to the space of each instanced object. The reason: Embree computes
//! distances as volumes (products of three lengths) divided by areas, in f32. The volumes underflow
//! in small scenes and overflow in large scenes. The limits keep a margin to the scales at which
//! images were wrong (docs/notebook/2026-11.md, "Range of scales").

use crate::geometry::{Mesh, Placement, retain_triangles, triangle_area};
use crate::light::LightGroups;
use crate::material::{Material, Quantity};
use crate::math::{Affine3A, Bounds3, Vec3, excerpt, excerpt_of_name};
use half::f16;
use thiserror::Error;

/// Maximum length of a light group's name in bytes. The names of its channels, such as
/// `light_NAME.R`, then have at most 31 bytes, which all EXR readers support.
const MAX_GROUP_NAME: usize = 23;

/// Largest valid coordinate. Embree computes distances as volumes divided by areas, in f32. The
/// results are wrong in scenes larger than about 5·10¹² units.
pub(super) const MAX_COORDINATE: f32 = 1e10;

/// Minimum extent of a scene or an instanced object. Triangles with edges of a thousandth of this
/// extent still work: the product of three such lengths, 10⁻³⁶, is larger than the smallest normal
/// f32, 1.2·10⁻³⁸.
const MIN_EXTENT: f32 = 1e-9;

/// Maximum coordinate of the position of a light. Also the maximum coordinate of the scene in the
/// space of an instanced object.
pub(super) const MAX_REACH: f32 = 1e15;

/// Errors of building a scene.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum BuildError {
    /// A triangle has a vertex index that is out of range.
    #[error("triangle {triangle} uses vertex {index}, but the mesh has {vertices} vertices")]
    IndexOutOfRange {
        /// Index of the triangle within its mesh.
        triangle: usize,
        /// The vertex index that is out of range.
        index: u32,
        /// Number of vertices of the mesh.
        vertices: usize,
    },
    /// A vertex is NaN or infinite, or its coordinates are too large for backends.
    #[error("vertex {vertex} is at ({}, {}, {}): coordinates must be finite and at most {MAX_COORDINATE:e}", position.x, position.y, position.z)]
    BadVertex {
        /// Index of the vertex within its mesh.
        vertex: usize,
        /// Position of the vertex.
        position: Vec3,
    },
    /// The extent of the scene or of an object is too small for backends.
    #[error("{what} is {extent:e} units wide, but needs at least {MIN_EXTENT:e} for ray tracing with 32-bit floats")]
    TooSmall {
        /// Name of what is too small: the scene, or an object.
        what: &'static str,
        /// Extent along the widest axis.
        extent: f32,
    },
    /// A deforming mesh has different numbers of vertices at shutter close and shutter open.
    #[error("the mesh has {open} vertices at time 0, but {close} at time 1")]
    OtherVertices {
        /// Number of vertices at shutter open.
        open: usize,
        /// Number of vertices at shutter close.
        close: usize,
    },
    /// The placement of an instance flattens the instance, turns it inside out during its motion,
    /// or has numbers that are too large or too small for backends.
    #[error("instance {instance} {problem}")]
    BadPlacement {
        /// Index of the instance, in the order in which instances were added.
        instance: usize,
        /// Description of the error.
        problem: &'static str,
    },
    /// A vertex attribute is missing for some vertices, or has an invalid value.
    #[error("vertex {vertex} has no {attribute} that is finite{}", if *.attribute == "normal" { " and not zero" } else { "" })]
    BadAttribute {
        /// Index of the vertex within its mesh.
        vertex: usize,
        /// Name of the attribute: normal, colour or texture coordinate.
        attribute: &'static str,
    },
    /// A material has an invalid value.
    #[error("material `{material}`: {key} is {value}, but must be {rule}")]
    BadMaterial {
        /// Name of the material.
        material: String,
        /// Key of the quantity.
        key: &'static str,
        /// Value that was set.
        value: String,
        /// Rule that the value breaks.
        rule: String,
    },
    /// A light has an invalid value.
    #[error("{light} light: {key} is {value}, but {rule}")]
    BadLight {
        /// Type of the light.
        light: &'static str,
        /// Key of the quantity.
        key: &'static str,
        /// Value that was set.
        value: String,
        /// Rule that the value breaks.
        rule: &'static str,
    },
    /// A section crosses an object that moves.
    #[error("the section cuts the object `{object}`, which moves")]
    MovesAcrossSection {
        /// Name of the object.
        object: String,
    },
    /// The ground has an invalid value.
    #[error("ground: {key} is {value}, but must be {rule}")]
    BadGround {
        /// Key of the quantity.
        key: &'static str,
        /// Value that was set.
        value: String,
        /// Rule that the value breaks.
        rule: &'static str,
    },
    /// The irradiance of the ground is unknown, so the fraction of arriving light cannot be
    /// computed.
    #[error("the ground cannot catch the shadows of a lamp whose emission is a texture")]
    UnknownIrradiance,
    /// The ground has too many lights to sum at each point.
    #[error(
        "the ground cannot catch the shadows of {count} lights that are not infinitely far away: the maximum is {max}, and each emitting triangle counts as a light"
    )]
    TooManyLightsOfGround {
        /// Number of finite lights.
        count: usize,
        /// Maximum number of finite lights.
        max: usize,
    },
    /// A light group has an invalid name.
    #[error("light group `{name}`: {rule}")]
    BadLightGroup {
        /// The name.
        name: String,
        /// Rule that the name breaks.
        rule: &'static str,
    },
    /// There are too many light groups.
    #[error("more than {} light groups", LightGroups::MAX_GROUPS - 1)]
    TooManyLightGroups,
    /// There are more meshes, triangles or lights than 32-bit ids can count.
    #[error("more than 2^32 - 2 {0} in one scene")]
    TooMany(&'static str),
}

/// Checks the arrays of a mesh, and normalises its normals.
pub(super) fn check_mesh(mesh: &mut Mesh) -> Result<(), BuildError> {
    let vertices = mesh.positions.len();
    if vertices > u32::MAX as usize - 1 {
        return Err(BuildError::TooMany("vertices"));
    }
    if mesh.deforms() && mesh.positions_close.len() != vertices {
        return Err(BuildError::OtherVertices {
            open: vertices,
            close: mesh.positions_close.len(),
        });
    }
    let bad = |p: &Vec3| !p.is_finite() || p.abs().max_element() > MAX_COORDINATE;
    for positions in [&mesh.positions, &mesh.positions_close] {
        if let Some(vertex) = positions.iter().position(bad) {
            return Err(BuildError::BadVertex {
                vertex,
                position: positions[vertex],
            });
        }
    }
    check_attributes(mesh)?;
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|&&i| i as usize >= vertices) {
            return Err(BuildError::IndexOutOfRange {
                triangle,
                index,
                vertices,
            });
        }
    }
    Ok(())
}

/// Removes triangles that have no area at any time, and returns their number.
pub(super) fn remove_degenerate(mesh: &mut Mesh) -> u64 {
    let before = mesh.triangles.len();
    let Mesh {
        positions,
        positions_close,
        triangles,
        parts,
        ..
    } = mesh;
    retain_triangles(triangles, parts, |corners| {
        let has_area = |positions: &[Vec3]| {
            let [p0, p1, p2] = corners.map(|i| positions[i as usize]);
            triangle_area(p0, p1, p2) > 0.0
        };
        has_area(positions) || (!positions_close.is_empty() && has_area(positions_close))
    });
    (before - triangles.len()) as u64
}

/// Checks that each attribute exists either for all vertices or for no vertex. Normalises normals.
fn check_attributes(mesh: &mut Mesh) -> Result<(), BuildError> {
    let vertices = mesh.positions.len();
    let bad = |attribute, vertex| Err(BuildError::BadAttribute { vertex, attribute });
    if !mesh.uvs.is_empty() {
        let wrong = mesh.uvs.iter().position(|uv| !uv.is_finite());
        let missing = (mesh.uvs.len() != vertices).then_some(mesh.uvs.len().min(vertices));
        if let Some(vertex) = wrong.or(missing) {
            return bad("texture coordinate", vertex);
        }
    }
    let is_share = |c: &f16| (0.0..=1.0).contains(&c.to_f32());
    let lists = [
        (
            mesh.colors.len(),
            mesh.colors.iter().position(|color| !color.iter().all(is_share)),
        ),
        (mesh.alphas.len(), mesh.alphas.iter().position(|alpha| !is_share(alpha))),
    ];
    for (length, wrong) in lists.into_iter().filter(|(length, _)| *length > 0) {
        let missing = (length != vertices).then_some(length.min(vertices));
        if let Some(vertex) = wrong.or(missing) {
            return bad("colour", vertex);
        }
    }
    if !mesh.normals.is_empty() {
        for (vertex, normal) in mesh.normals.iter_mut().enumerate() {
            match normal.try_normalize() {
                Some(unit) => *normal = unit,
                None => return bad("normal", vertex),
            }
        }
        if mesh.normals.len() != vertices {
            return bad("normal", mesh.normals.len().min(vertices));
        }
    }
    // Remove the normals at shutter close if they are incomplete, or if there are no normals at
    // shutter open.
    if mesh.normals.is_empty() || mesh.normals_close.len() != vertices {
        mesh.normals_close = Vec::new();
    }
    for normal in &mut mesh.normals_close {
        *normal = normal.normalize_or_zero();
    }
    Ok(())
}

/// Checks the name of a light group. The name is part of channel names.
pub(super) fn check_group_name(name: &str) -> Result<(), BuildError> {
    let is_allowed = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let rule = if name.is_empty() {
        "the name is empty"
    } else if name == LightGroups::DEFAULT {
        "this name is reserved for lights without a group"
    } else if !name.chars().all(is_allowed) {
        "a name may have letters A to Z and a to z, digits and underscores only"
    } else if name.len() > MAX_GROUP_NAME {
        "the name is longer than 23 letters"
    } else {
        return Ok(());
    };
    Err(BuildError::BadLightGroup {
        name: excerpt(name).escape_debug().to_string(),
        rule,
    })
}

/// Checks the placement of `instance`. `bounds` is the box of the instanced object.
pub(super) fn check_placement(instance: usize, placement: &Placement, bounds: Bounds3) -> Result<(), BuildError> {
    let bad = |problem| Err(BuildError::BadPlacement { instance, problem });
    let determinants = || placement.steps().iter().map(|step| step.matrix3.determinant());
    if !placement.steps().iter().all(|step| step.is_finite()) || !determinants().all(|d| d.is_finite() && d != 0.0) {
        return bad("is flattened, or its placement is not finite");
    }
    if determinants().any(|d| d < 0.0) && determinants().any(|d| d > 0.0) {
        return bad("turns inside out during its motion");
    }
    if placement.is_moving() && !(2..=Placement::MAX_STEPS).contains(&placement.steps().len()) {
        return bad("has too few or too many steps of motion");
    }
    let bounds = placement.bounds(bounds);
    let within = |p: Vec3| p.abs().cmple(Vec3::splat(MAX_COORDINATE)).all();
    if !bounds.is_empty() && ![bounds.min, bounds.max].into_iter().all(within) {
        return bad("reaches beyond coordinates of 1e10");
    }
    Ok(())
}

/// Checks that `bounds` are large enough for the arithmetic of backends. `what` names the scene or
/// object in the error.
pub(super) fn check_extent(what: &'static str, bounds: Bounds3) -> Result<(), BuildError> {
    let extent = (bounds.max - bounds.min).max_element();
    if bounds.is_empty() || extent >= MIN_EXTENT {
        Ok(())
    } else {
        Err(BuildError::TooSmall { what, extent })
    }
}

/// Checks that `instance` does not shrink its object too much: in the object's space, the
/// coordinates of the scene must stay in range. `largest` is the scene's largest coordinate.
pub(super) fn check_reach(instance: usize, placement: &Placement, largest: f32) -> Result<(), BuildError> {
    let reach = |step: &Affine3A| {
        let inverse = step.matrix3.inverse();
        let growth = [inverse.x_axis, inverse.y_axis, inverse.z_axis].map(Vec3::length);
        2.0 * largest * growth.into_iter().fold(0.0, f32::max)
    };
    if placement.steps().iter().map(reach).all(|reach| reach <= MAX_REACH) {
        Ok(())
    } else {
        Err(BuildError::BadPlacement {
            instance,
            problem: "is scaled down so far that the scene is more than 1e15 units wide in the units of its object",
        })
    }
}

/// Checks the values of a material.
pub(super) fn check_material(material: &Material) -> Result<(), BuildError> {
    for quantity in Quantity::all() {
        if let Some((value, rule)) = quantity.range.violation(&(quantity.numbers)(material)) {
            return Err(BuildError::BadMaterial {
                material: excerpt_of_name(&material.name).into_owned(),
                key: quantity.key,
                value,
                rule,
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::SceneBuilder;
    use super::*;
    use crate::bsdf::Fresnel;
    use crate::color::Spectrum;
    use crate::material::Gloss;

    #[test]
    fn invalid_materials_are_errors() {
        let mut b = SceneBuilder::new();
        let base = Material::default;
        let metal = |eta, k| {
            Gloss::Mirror(Fresnel::Conductor {
                eta: [eta; 3],
                k: [k; 3],
            })
        };
        for (bad, key) in [
            (
                Material {
                    specular: Spectrum::splat(-0.1),
                    ..base()
                },
                "specular",
            ),
            (
                Material {
                    transmission: Spectrum::splat(f32::NAN),
                    ..base()
                },
                "transmission",
            ),
            (Material { ior: 0.0, ..base() }, "ior"),
            (
                Material {
                    gloss: Gloss::Phong(-1.0),
                    ..base()
                },
                "exponent",
            ),
            (
                Material {
                    gloss: Gloss::Blinn(f32::INFINITY, Fresnel::Full),
                    ..base()
                },
                "exponent",
            ),
            (
                Material {
                    gloss: metal(0.0, 1.0),
                    ..base()
                },
                "eta",
            ),
            (
                Material {
                    gloss: metal(1.0, -1.0),
                    ..base()
                },
                "k",
            ),
            (
                Material {
                    gloss: Gloss::Metallic(1.5),
                    ..base()
                },
                "metallic",
            ),
            (
                Material {
                    roughness: f32::NAN,
                    ..base()
                },
                "roughness",
            ),
            (
                Material {
                    clearcoat: 1.5,
                    ..base()
                },
                "clearcoat",
            ),
            (
                Material {
                    clearcoat_roughness: f32::NAN,
                    ..base()
                },
                "clearcoat_roughness",
            ),
            (
                Material {
                    sheen: Spectrum::rgb(0.0, 1.5, 0.0),
                    ..base()
                },
                "sheen",
            ),
            (
                Material {
                    anisotropy: -0.5,
                    ..base()
                },
                "anisotropy",
            ),
            (
                Material {
                    anisotropy_rotation: f32::INFINITY,
                    ..base()
                },
                "anisotropy_rotation",
            ),
            (
                Material {
                    gloss: Gloss::Ggx(Fresnel::Schlick { f0: [0.5, -0.1, 0.5] }),
                    ..base()
                },
                "f0",
            ),
        ] {
            let error = b.add_material(bad).unwrap_err();
            assert!(error.to_string().contains(&format!("{key} is")), "{error}");
        }
    }
}

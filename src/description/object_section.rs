use super::exact_list::{matrix, plain_numbers};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use toml::Spanned;

/// `[[object]]`
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectSection {
    /// OBJ file, relative to the scene file.
    pub obj: Spanned<PathBuf>,
    /// What mattes call it; the OBJ's stem if this is left out.
    pub name: Option<String>,
    /// Placement in the world.
    pub transform: Option<Spanned<TransformSection>>,
    /// Placement as four rows of four, instead of `transform`.
    #[serde(default, deserialize_with = "matrix")]
    pub matrix: Option<Spanned<[[f32; 4]; 4]>>,
    /// Placement at time 1, if the object moves.
    pub transform_close: Option<Spanned<TransformSection>>,
    /// Placement at time 1 as four rows of four.
    #[serde(default, deserialize_with = "matrix")]
    pub matrix_close: Option<Spanned<[[f32; 4]; 4]>>,
    /// OBJ file of its shape at time 1, if that changes.
    pub obj_close: Option<Spanned<PathBuf>>,
    /// Where copies of it stand.
    pub instances: Option<Spanned<Instances>>,
}

/// `instances = …`
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(
    untagged,
    expecting = "instances must be a file name or a list of matrices, each four rows of four"
)]
pub enum Instances {
    /// A file with one placement a line.
    File(PathBuf),
    /// The placements.
    Matrices(Vec<[[f32; 4]; 4]>),
}

/// `transform = { … }`
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TransformSection {
    /// Applied last.
    #[serde(default, deserialize_with = "plain_numbers")]
    pub translate: Option<[f32; 3]>,
    /// Rotation in degrees about the fixed x, y and z axes, in that order.
    #[serde(default, deserialize_with = "plain_numbers")]
    pub rotate: Option<[f32; 3]>,
    /// Applied first.
    pub scale: Option<Scale>,
}

/// One factor, or one for each axis.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(untagged, expecting = "scale must be a number or three numbers")]
pub enum Scale {
    /// One factor for all axes.
    Uniform(f32),
    /// Along x, y and z.
    Axes([f32; 3]),
}

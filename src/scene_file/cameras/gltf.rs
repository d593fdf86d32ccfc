//! Cameras of glTF scenes, text or binary.
//!
//! Source: glTF 2.0 Specification (Khronos), 3.10 "Cameras" and 4.4 "Binary glTF". A camera views
//! along −z of its node, with +y up.

use super::{FileCamera, json_error};
use crate::camera::ProjectionKind;
use crate::files::input::read_bytes;
use crate::math::{DMat4, DQuat, DVec3};
use crate::options::{CameraOptions, PoseConvention, PoseMatrix};
use crate::scene_file::FileError;
use serde::Deserialize;
use std::path::Path;

#[derive(Deserialize)]
struct Gltf {
    #[serde(default)]
    nodes: Vec<Node>,
    #[serde(default)]
    cameras: Vec<Camera>,
}

#[derive(Deserialize)]
struct Node {
    name: Option<String>,
    camera: Option<usize>,
    #[serde(default)]
    children: Vec<usize>,
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct Camera {
    name: Option<String>,
    perspective: Option<Perspective>,
    orthographic: Option<Orthographic>,
}

#[derive(Deserialize)]
struct Perspective {
    yfov: f64,
}

#[derive(Deserialize)]
struct Orthographic {
    ymag: f64,
}

impl Node {
    /// Transform from the node to its parent.
    fn transform(&self) -> DMat4 {
        let [x, y, z, w] = self.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let parts = DMat4::from_scale_rotation_translation(
            self.scale.unwrap_or([1.0; 3]).into(),
            DQuat::from_xyzw(x, y, z, w).normalize(),
            self.translation.unwrap_or_default().into(),
        );
        self.matrix.map_or(parts, |matrix| DMat4::from_cols_array(&matrix))
    }
}

/// Reads the cameras of a glTF scene: one for each node with a camera.
pub(super) fn read(path: &Path) -> Result<Vec<FileCamera>, FileError> {
    let bytes = read_bytes(path, "the glTF file")?;
    let json = json_of(&bytes);
    let gltf: Gltf = serde_json::from_slice(json)
        .map_err(|error| json_error(path, &error).help("export the file again, as glTF 2.0 with cameras"))?;
    let mut parents = vec![None; gltf.nodes.len()];
    for (index, node) in gltf.nodes.iter().enumerate() {
        for &child in &node.children {
            if let Some(parent) = parents.get_mut(child) {
                *parent = Some(index);
            }
        }
    }
    let mut cameras = Vec::new();
    for (index, node) in gltf.nodes.iter().enumerate() {
        let Some(number) = node.camera else { continue };
        let name = node.name.clone().unwrap_or_else(|| index.to_string());
        let wrong = |message: String| {
            let message = format!("camera `{name}`: {message}");
            FileError::new(path, message).help("export the file again")
        };
        let Some(camera) = gltf.cameras.get(number) else {
            return Err(wrong(format!("there is no camera {number} in the file")));
        };
        // Multiply the transforms of all parents. The loop ends after as many steps as there are
        // nodes, in case the parents form a cycle.
        let mut to_world = node.transform();
        let mut above = parents[index];
        for _ in 0..gltf.nodes.len() {
            let Some(parent) = above else { break };
            to_world = gltf.nodes[parent].transform() * to_world;
            above = parents[parent];
        }
        cameras.push(FileCamera {
            name: camera_name(node, camera, &name),
            size: None,
            options: options(camera, to_world).map_err(wrong)?,
            horizontal_fov: None,
        });
    }
    Ok(cameras)
}

/// Name of the camera of `node`. Some exporters put the camera in a child node that rotates the
/// camera. The name of such a node ends with `_Orientation` and is not used.
fn camera_name(node: &Node, camera: &Camera, name: &str) -> String {
    let own = node.name.as_ref().filter(|name| !name.ends_with("_Orientation"));
    own.or(camera.name.as_ref()).map_or(name, |name| name).to_string()
}

fn options(camera: &Camera, to_world: DMat4) -> Result<CameraOptions, String> {
    // Normalise the axes, because scaled nodes do not change the view of a camera
    let axis = |axis: DVec3| axis.normalize_or_zero();
    let [x, y, z] = [to_world.x_axis, to_world.y_axis, to_world.z_axis].map(|column| axis(column.truncate()));
    let position = to_world.w_axis.truncate();
    let pose = PoseMatrix {
        convention: PoseConvention::Blender,
        rows: [0, 1, 2].map(|row| [x[row], y[row], z[row], position[row]]),
    };
    pose.pose().map_err(|message| format!("its transform {message}"))?;
    let lens = match (&camera.perspective, &camera.orthographic) {
        (Some(Perspective { yfov }), _) if *yfov > 0.0 && *yfov < std::f64::consts::PI => CameraOptions {
            vertical_fov: Some(yfov.to_degrees() as f32),
            ..CameraOptions::default()
        },
        (Some(Perspective { yfov }), _) => return Err(format!("`yfov` is {yfov}, not an angle between 0 and pi")),
        (None, Some(Orthographic { ymag })) if *ymag > 0.0 => CameraOptions {
            projection: Some(ProjectionKind::Orthographic),
            ortho_height: Some((2.0 * ymag) as f32),
            ..CameraOptions::default()
        },
        (None, Some(Orthographic { ymag })) => return Err(format!("`ymag` is {ymag}, not above 0")),
        (None, None) => return Err("it is neither a perspective nor orthographic".into()),
    };
    Ok(CameraOptions {
        pose: Some(pose),
        ..lens
    })
}

/// JSON text of a file. A binary file has the text in its first chunk.
fn json_of(bytes: &[u8]) -> &[u8] {
    let Some(rest) = bytes.strip_prefix(b"glTF") else {
        return bytes;
    };
    // Skip version and length of the file, then read length and kind of the chunk
    let length = rest
        .get(8..12)
        .and_then(|length| length.try_into().ok())
        .map(u32::from_le_bytes);
    let end = length.and_then(|length| usize::try_from(length).ok()?.checked_add(16));
    end.and_then(|end| rest.get(16..end)).unwrap_or(&[])
}

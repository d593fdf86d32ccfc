//! The scene description: what a scene file says, and the scene that is made of it and of the files that it names.
//!
//! `scene_file` reads the file, the `*_section` modules are its parts, `placement` resolves where objects stand, and `load` reads the named files and
//! builds the scene. Formats of meshes and pictures are in `io`, and parameters of a render in `options`.

mod ground_section;
mod light_group_section;
mod light_section;
mod load;
mod map_section;
mod material_section;
mod option_section;
mod overrides;
mod placement;
mod scene_file;
mod unknown_key;

pub use ground_section::{Albedo, GroundSection};
pub use light_group_section::LightGroupSection;
pub use light_section::{LightSection, Rotation};
pub use load::{
    DEFAULT_MATERIAL, Inspection, Loaded, MaterialSource, ObjSource, inspect_scene, load_scene, load_scene_watched,
};
pub use map_section::MapSection;
pub use material_section::MaterialSection;
pub use scene_file::{CameraSection, Instances, ObjectSection, Scale, SceneFile, SceneOptions, TransformSection};

// What the modules here need of the formats
use crate::io::{
    FileError, Finding, Findings, LoadObserver, LoadOptions, LoadParameters, MemoryLimit, Position, Severity,
    environment, find_file, input, memory, mtl, obj, statements, texture,
};

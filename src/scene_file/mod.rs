//! Scene files, and the scene built from a scene file and from the files that it names.
//!
//! `file` reads the file, and the `*_section` modules are its sections. `source` adds the
//! place in the file to errors. `scene_options` lists the options of the sections `[camera]`,
//! `[image]` and `[render]`. `patches` lists changes of materials, `placement` computes the
//! transforms of objects, and `load` reads the named files and builds the scene. `write` makes the
//! text of a scene file, and `schema` its JSON Schema. `io` has the formats of meshes and pictures,
//! `options` the parameters of a render.

#[cfg(feature = "cli")]
mod cameras;
mod color_value;
mod cut_section;
mod exact_list;
mod file;
mod find_texture;
mod ground_section;
mod in_order;
mod key_schema;
mod levels;
mod light_changes;
mod light_group_section;
mod light_section;
mod load;
mod made_lights;
mod made_object;
mod map_section;
mod material_section;
mod object_section;
mod option_section;
mod overrides;
mod part_section;
mod patches;
mod placement;
mod presets;
mod scene_options;
mod schema;
mod section;
mod source;
mod template;
mod unknown_key;
mod write;

pub use crate::lint::{DEFAULT_MATERIAL, Inspection, MaterialSource, ObjSource};
pub use color_value::{ChannelValues, ColorValue};
pub use cut_section::CutSection;
pub use file::SceneFile;
pub use ground_section::GroundSection;
pub use in_order::InOrder;
pub use light_group_section::LightGroupSection;
pub use light_section::{DEFAULT_SUN, LightSection, Rotation};
pub use load::{LoadedScene, inspect_scene, load_scene, load_scene_watched};
pub(crate) use load::{UnlitScene, load_scene_to_light};
pub use made_object::MadeObject;
pub use map_section::{MapSection, TextureSection};
pub use material_section::MaterialSection;
pub use object_section::{Instances, ObjectSection, Scale, TransformSection, WrittenSubdivision};
pub use part_section::{PartKeys, PartSection};
pub use presets::{PRESETS, Preset};
pub use scene_options::SceneOptions;
pub use schema::schema_text;

#[cfg(feature = "cli")]
pub(crate) use cameras::FileCamera;
pub(crate) use levels::{LEVELS, ObjectCage};
pub(crate) use light_changes::{Environment, LightChanges, Sun, Viewpoint};
#[cfg(all(test, feature = "cli"))]
pub(crate) use section::Section;

#[cfg(feature = "cli")]
pub(crate) use light_section::LightType;
#[cfg(feature = "view")]
pub(crate) use {
    patches::glob_of_name,
    schema::{light_keys, material_keys},
};

// Items of the file formats that several modules use
use crate::files::{MemoryLimit, find_file, input, memory};
use crate::io::{
    DEFAULT_LIGHT, FileError, Finding, Findings, LoadObserver, LoadOptions, LoadParameters, Position, Severity,
    Warning, environment, load_obj, mtl, obj, statements, texture,
};

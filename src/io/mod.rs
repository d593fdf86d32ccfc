//! Files in and out: scene files, OBJ and MTL, textures, EXR and PNG.

mod checkpoint;
mod contact_sheet;
mod cryptomatte;
mod environment;
mod error;
mod exr;
mod find_file;
mod finding;
mod input;
mod light_group_section;
mod light_section;
mod load;
mod load_options;
mod machine;
mod map_section;
mod material_section;
mod memory;
mod mtl;
mod names;
mod normals;
mod obj;
mod output;
mod placement;
mod png;
mod read_image;
mod read_picture;
mod read_rendering;
mod scene_file;
mod statements;
mod texture;

pub use checkpoint::{Checkpoint, Description, State, describe_checkpoint, read_checkpoint};
pub use contact_sheet::{Panel, write_contact_sheet};
pub use cryptomatte::cryptomattes;
pub use error::{FileError, Position};
pub use exr::{Compression, ExrFormat, FeatureNames, Metadata};
use finding::MAX_WRONG;
pub use finding::{Finding, Findings, MOST_PLACES, Severity};
pub use light_group_section::LightGroupSection;
pub use light_section::{LightSection, Rotation};
pub use load::{
    DEFAULT_MATERIAL, Inspection, Loaded, MaterialSource, ObjSource, inspect_scene, load_scene, load_scene_watched,
};
pub use load_options::LoadOptions;
pub use map_section::MapSection;
pub use material_section::MaterialSection;
pub use memory::{LimitSource, LoadObserver, MemoryLimit, in_words};
pub use mtl::MtlDialect;
pub(crate) use names::{find, join_names, name_of, named};
pub use normals::{area_vector, smooth_by_angle, weld};
pub use obj::{Face, FaceMaterial, ObjFaces};
pub use output::{Format, Output};
pub use png::Figure;
pub use read_image::read_exr;
pub use read_picture::is_decoding;
pub use read_rendering::{Rendering, read_rendering};
pub use scene_file::{
    CameraSection, ImageSection, Instances, MaxDepth, ObjectSection, RenderSection, Scale, SceneFile, TransformSection,
};
pub use texture::{LoadedTextures, TextureKind, TextureRequest, load_texture, load_textures};

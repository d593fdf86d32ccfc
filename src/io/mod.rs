//! Files in and out: scene files, OBJ and MTL, textures, EXR and PNG.

mod contact_sheet;
mod environment;
mod error;
mod exr;
mod find_file;
mod light_section;
mod load;
mod map_section;
mod material_section;
mod mtl;
mod mtl_map;
mod normals;
mod obj;
mod output;
mod placement;
mod png;
mod read_image;
mod read_picture;
mod scene_file;
mod statements;
mod texture;

pub use contact_sheet::{Panel, write_contact_sheet};
pub use error::{FileError, Position};
pub use exr::Metadata;
pub use light_section::{LightSection, Rotation};
pub use load::{LoadOptions, Loaded, load_scene};
pub use map_section::MapSection;
pub use material_section::MaterialSection;
pub use mtl::MtlDialect;
pub use normals::smooth_by_angle;
pub use output::{Format, Output};
pub use read_image::read_exr;
pub use scene_file::{
    CameraSection, ImageSection, Instances, MaxDepth, ObjectSection, RenderSection, Scale, SceneFile, TransformSection,
};
pub use texture::{LoadedTextures, TextureKind, TextureRequest, load_texture, load_textures};

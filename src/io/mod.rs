//! Files in and out: scene files, OBJ and MTL, textures, EXR and PNG.

mod contact_sheet;
mod environment;
mod error;
mod exr;
mod light_section;
mod load;
mod material_section;
mod mtl;
mod obj;
mod obj_blame;
mod output;
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
pub use load::{Loaded, load_scene};
pub use material_section::MaterialSection;
pub use output::{Format, Output};
pub use read_image::read_exr;
pub use scene_file::{CameraSection, ImageSection, MaxDepth, ObjectSection, RenderSection, SceneFile};
pub use texture::{LoadedTextures, TextureKind, TextureRequest, load_texture, load_textures};

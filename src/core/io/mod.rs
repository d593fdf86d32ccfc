//! Formats of meshes and pictures for reading and writing: OBJ and MTL, textures, environments, EXR
//! and PNG. The module `files` has functions that all formats use.

mod ascii;
mod block_compression;
mod checkpoint;
mod contact_sheet;
mod cryptomatte;
mod dds;
mod developed;
pub mod displacement;
pub mod environment;
mod exr;
mod exr_file;
mod exr_text;
mod figure;
mod finding;
pub mod half_picture;
mod header_limits;
pub mod load_obj;
mod load_options;
mod matte_mask;
mod mattes;
mod metadata;
pub mod mtl;
mod normal_map;
mod normals;
pub mod obj;
mod origin;
pub mod packed;
mod part_filter;
mod picture;
mod png;
mod read_image;
mod read_layers;
mod read_picture;
mod read_rendering;
pub mod statements;
mod subdivision;
pub mod texture;
#[cfg(feature = "tobj")]
mod tobj_reader;
mod udim;
mod write_picture;

pub use crate::files::{FileError, FileErrorKind, LoadObserver, Position};
pub use checkpoint::{Checkpoint, Description, State, describe_checkpoint, read_checkpoint};
pub use contact_sheet::{Mark, Panel, edge_of_plan, write_contact_sheet, write_sheet_with_plan};
pub use cryptomatte::cryptomattes;
pub use developed::DevelopedPicture;
pub use exr::{Compression, ExrFormat};
pub use figure::Figure;
use finding::MAX_WRONG;
pub use finding::{DEFAULT_LIGHT, Finding, Findings, MAX_PLACES, Severity, Warning};
pub use load_options::{
    CutCaps, DisplacementUse, FileUnit, LoadOptions, LoadParameters, MapsByName, ObjReader, VertexColorSpace,
    VertexColors,
};
pub use matte_mask::MatteMask;
pub use mattes::Mattes;
pub use metadata::{FeatureNames, Metadata};
pub use mtl::MtlDialect;
pub use normals::{area_vector, smooth_by_angle, weld};
pub use obj::{Cage, CageNode, Face, FaceMaterial, ObjFaces};
pub use origin::Origin;
pub use part_filter::{PartFilter, PartMovement, PartRule};
pub use png::{display_bytes, png_bytes};
pub use read_image::read_exr;
pub use read_layers::{LayerChannel, Layers, SampleKind, read_layers};
pub use read_rendering::{Rendering, read_rendering};
pub use subdivision::Subdivision;
pub use texture::{LoadedTextures, TextureKind, TextureRequest, load_texture, load_textures};
pub use udim::{Tiles, path_of_tiles, tile_names};
pub use write_picture::Format;

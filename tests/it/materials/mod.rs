//! Lobes, materials, textures and libraries of materials.

mod bodies;
mod bsdf;
mod dispersion;
mod displacement;
mod mtl;
mod named_maps;
mod patches;
mod surfaces;
mod textures;
mod udim;
mod vertex_colors;

//! Previews: pictures of a model before a background, with the name of the OBJ file. They are not
//! textures of the model.
//!
//! The background of a texture is the part that no surface uses. The surfaces of a model use the
//! background of a preview as much as the rest of the preview.

use crate::geometry::Mesh;
use crate::math::Vec2;
use crate::scene_file::texture::{TextureKind, load_texture, texture_size};
use crate::texture::Wrap;
use std::path::Path;

/// Number of cells along each side of the grid in which the picture is examined.
const CELLS: usize = 96;
/// Maximum difference of neighbouring cells of the background in each channel, about as displays
/// encode them.
const STEP: f32 = 0.03;
/// Range of the fraction of the background. A picture of fewer colours may be all background.
const BACKGROUND: std::ops::RangeInclusive<f32> = 0.15..=0.9;
/// Minimum fraction of the cells at the border of the picture with a similar neighbour. Islands of
/// textures often reach the border.
const EVEN: f32 = 0.998;
/// Minimum ratio of the fraction of the surfaces on the background to the fraction of the
/// background.
const USED: f32 = 0.75;
/// Maximum width and height of a preview in texels: textures are often larger.
const MAX_SIDE: u64 = 1024;
/// Minimum number of triangles of a model with a preview: posters have fewer.
const MIN_TRIANGLES: usize = 64;
/// Maximum number of triangles that are examined, evenly spread.
const MAX_TRIANGLES: usize = 1 << 14;

/// Cells of a picture that belong to its background.
#[derive(Clone, Debug)]
pub(super) struct Background(Vec<bool>);

impl Background {
    /// The background: cells that are connected with the border by small steps of colour. `None` if
    /// the picture cannot be read, if its border is not even, or if the background is small or is
    /// the whole picture.
    pub fn of(path: &Path) -> Option<Self> {
        texture_size(path).filter(|(width, height)| width.max(height) <= &MAX_SIDE)?;
        let picture = load_texture(path, TextureKind::Color, Wrap::Clamp).ok()?;
        let center = |i: usize| (i as f32 + 0.5) / CELLS as f32;
        let cells: Vec<[f32; 4]> = (0..CELLS * CELLS)
            .map(|i| {
                let uv = Vec2::new(center(i % CELLS), center(i / CELLS));
                let footprint = 1.0 / CELLS as f32;
                let alpha = if picture.has_alpha() {
                    picture.alpha(uv, footprint)
                } else {
                    1.0
                };
                // The colour of a transparent cell has no effect
                let [r, g, b] = picture
                    .color(uv, footprint)
                    .to_array()
                    .map(|x| alpha * x.max(0.0).sqrt());
                [r, g, b, alpha]
            })
            .collect();
        let are_alike = |i: usize, j: usize| (0..4).all(|c| (cells[i][c] - cells[j][c]).abs() <= STEP);
        let last = CELLS - 1;
        let sides = (0..CELLS).flat_map(|i| [(i, 0), (i, last), (0, i), (last, i)]);
        let border: Vec<usize> = sides.map(|(x, y)| y * CELLS + x).collect();
        let pairs = border.iter().zip(border.iter().skip(4));
        let even = pairs.filter(|&(&i, &j)| are_alike(i, j)).count();
        if (even as f32) < EVEN * (border.len() - 4) as f32 {
            return None;
        }
        let mut is_in = vec![false; CELLS * CELLS];
        let mut open = border;
        open.iter().for_each(|&i| is_in[i] = true);
        while let Some(i) = open.pop() {
            let (x, y) = (i % CELLS, i / CELLS);
            let beside = [
                (x > 0).then(|| i - 1),
                (x < last).then_some(i + 1),
                (y > 0).then(|| i - CELLS),
                (y < last).then_some(i + CELLS),
            ];
            for j in beside.into_iter().flatten() {
                if !is_in[j] && are_alike(i, j) {
                    is_in[j] = true;
                    open.push(j);
                }
            }
        }
        Some(Self(is_in)).filter(|found| BACKGROUND.contains(&found.share()))
    }

    /// Returns true if the surfaces of a mesh use the background as much as the rest of the
    /// picture. False for a mesh of few triangles.
    pub fn is_used_by(&self, mesh: &Mesh) -> bool {
        let count = mesh.triangles.len();
        if count < MIN_TRIANGLES || mesh.uvs.is_empty() {
            return false;
        }
        let (mut on, mut all) = (0.0, 0.0);
        for triangle in mesh.triangles.iter().step_by(count.div_ceil(MAX_TRIANGLES)) {
            let [a, b, c] = triangle.map(|i| mesh.uvs[i as usize]);
            let area = (b - a).perp_dot(c - a).abs();
            if area.is_finite() {
                all += area;
                on += if self.has((a + b + c) / 3.0) { area } else { 0.0 };
            }
        }
        all > 0.0 && on >= USED * self.share() * all
    }

    /// Fraction of the picture.
    fn share(&self) -> f32 {
        self.0.iter().filter(|is_in| **is_in).count() as f32 / self.0.len() as f32
    }

    /// Returns true if the background contains the point `uv`.
    fn has(&self, uv: Vec2) -> bool {
        let cell = |x: f32| ((x.rem_euclid(1.0) * CELLS as f32) as usize).min(CELLS - 1);
        self.0[cell(uv.y) * CELLS + cell(uv.x)]
    }
}

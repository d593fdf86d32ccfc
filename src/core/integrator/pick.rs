//! The surface under a pixel that the user selects, and its outline in the image.

use super::world::World;
use crate::accel::Accel;
use crate::camera::{Camera, View};
use crate::geometry::Hit;
use crate::math::{UVec2, Vec2, Vec3};
use rayon::prelude::*;

/// The first surface that a camera ray through the middle of a pixel hits.
#[derive(Clone, Copy, Debug)]
pub struct PickedSurface {
    /// Hit of the ray through the middle of the pixel.
    pub hit: Hit,
    /// World-space position of the hit.
    pub position: Vec3,
}

/// Selection key of a surface: ids of its object and of its material. Surfaces with the same key
/// are selected together.
type ObjectMaterial = (u32, u32);

impl<A: Accel> World<'_, A> {
    /// Returns the first surface that a ray through the middle of `pixel` hits. The picture
    /// consists of `views`. Returns `None` for the background or the ground.
    pub fn pick(&self, views: &[View], pixel: UVec2) -> Option<PickedSurface> {
        let hit = self.first_hit(views, pixel.as_vec2() + 0.5)?;
        let position = self.scene.surface_point(&hit, self.camera.time(0.5)).p;
        Some(PickedSurface { hit, position })
    }

    /// Outline of all surfaces that are selected together with `picked`. The picture, which
    /// consists of `views`, is divided into a grid of `size` cells. Returns run lengths, row by
    /// row. Runs of cells without these surfaces alternate with runs of cells that show them. The
    /// first run has cells without these surfaces, and may be empty.
    pub fn outline(&self, views: &[View], picked: &PickedSurface, size: UVec2) -> Vec<u32> {
        let part = self.part(&picked.hit);
        let cell = self.camera.resolution().as_vec2() / size.as_vec2();
        let row = |y: u32| -> Vec<bool> {
            let shows = |x: u32| {
                let film = (UVec2::new(x, y).as_vec2() + 0.5) * cell;
                self.first_hit(views, film).is_some_and(|hit| self.part(&hit) == part)
            };
            (0..size.x).map(shows).collect()
        };
        let rows: Vec<Vec<bool>> = (0..size.y).into_par_iter().map(row).collect();
        runs(rows.into_iter().flatten())
    }

    /// Traces the ray from the middle of the lens through the film point `film` (pixels), with the
    /// camera of the view at this point. Returns the hit. `None` for the background or a
    /// shadow-catching ground.
    fn first_hit(&self, views: &[View], film: Vec2) -> Option<Hit> {
        let (camera, film) = view_at(views, film)?;
        let ray = camera.ray(film, Vec2::splat(0.5), camera.time(0.5));
        let hit = self.accel.intersect(&ray)?;
        let is_ground = self.scene.ground().is_some_and(|ground| ground.is_at(&hit));
        (!is_ground).then_some(hit)
    }

    fn part(&self, hit: &Hit) -> ObjectMaterial {
        (self.scene.object(hit), self.scene.material_id(hit))
    }
}

/// Camera of the view at the point `film` of the picture, and the point in the view.
fn view_at(views: &[View], film: Vec2) -> Option<(&Camera, Vec2)> {
    views.iter().find_map(|view| {
        let point = film - view.corner.as_vec2();
        let size = view.camera.resolution().as_vec2();
        let is_inside = point.cmpge(Vec2::ZERO).all() && point.cmplt(size).all();
        is_inside.then_some((&view.camera, point))
    })
}

/// Run lengths of `cells`: first the number of `false` values, then the number of `true` values
/// that follow, and so on.
fn runs(cells: impl Iterator<Item = bool>) -> Vec<u32> {
    let mut runs = vec![0];
    let mut is_in = false;
    for cell in cells {
        if cell != is_in {
            runs.push(0);
            is_in = cell;
        }
        if let Some(run) = runs.last_mut() {
            *run += 1;
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_run_counts_cells_outside() {
        assert_eq!(runs([true, true, false, true].into_iter()), [0, 2, 1, 1]);
        assert_eq!(runs([false; 3].into_iter()), [3]);
        assert_eq!(runs([].into_iter()), [0]);
    }
}

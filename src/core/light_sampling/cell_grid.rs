use crate::math::{Bounds3, Vec3};

/// Numbers of cells along the longest side of the grid. They are tried in this order.
const RESOLUTIONS: [u32; 14] = [48, 40, 32, 28, 24, 20, 16, 13, 10, 8, 6, 4, 2, 1];
/// Fraction of the points that the grid leaves out at each end of each axis. The outermost points
/// may be far away, and few paths reach them.
const OUTSIDE: f64 = 0.005;
/// Number that marks a cell without surfaces.
const EMPTY: u32 = u32::MAX;

/// Regular grid over a box. Only cells that contain surfaces are numbered, from 0.
#[derive(Clone, Debug)]
pub(super) struct CellGrid {
    min: Vec3,
    /// Cells per scene unit.
    scale: f32,
    counts: [u32; 3],
    /// Number (id) of each cell of the box; [`EMPTY`] if the cell contains no known surface.
    numbers: Vec<u32>,
    /// Grid coordinates of each numbered cell.
    places: Vec<[u32; 3]>,
}

impl CellGrid {
    /// Grid around nearly all of `points`: the finest one in which at most `max_cells` cells
    /// contain points.
    pub fn new(points: &[Vec3], max_cells: usize) -> Option<Self> {
        let bounds = bounds_of_most(points)?;
        RESOLUTIONS.into_iter().find_map(|resolution| {
            let mut grid = Self::empty(bounds, resolution);
            let mut is_known = vec![false; grid.numbers.len()];
            points
                .iter()
                .filter_map(|&p| grid.index(p))
                .for_each(|i| is_known[i] = true);
            let count = is_known.iter().filter(|known| **known).count();
            if count > max_cells || count == 0 {
                return None;
            }
            for (i, _) in is_known.iter().enumerate().filter(|(_, known)| **known) {
                grid.numbers[i] = grid.places.len() as u32;
                let [nx, ny, _] = grid.counts.map(|n| n as usize);
                grid.places.push([i % nx, i / nx % ny, i / (nx * ny)].map(|i| i as u32));
            }
            Some(grid)
        })
    }

    fn empty(bounds: Bounds3, resolution: u32) -> Self {
        let extent = bounds.max - bounds.min;
        let size = extent.max_element() / resolution as f32;
        let size = if size > 0.0 && size.is_finite() { size } else { 1.0 };
        let counts = extent
            .to_array()
            .map(|e| ((e / size).ceil() as u32).clamp(1, resolution));
        Self {
            min: bounds.min,
            scale: 1.0 / size,
            counts,
            numbers: vec![EMPTY; counts.iter().map(|&n| n as usize).product()],
            places: Vec::new(),
        }
    }

    /// Index in `numbers` of the cell that contains `p`. `None` if `p` is outside of the box.
    #[inline(always)]
    fn index(&self, p: Vec3) -> Option<usize> {
        let x = (p - self.min) * self.scale;
        let end = Vec3::from_array(self.counts.map(|n| n as f32));
        // Return `None` for NaN too
        if !(x.cmpge(Vec3::ZERO).all() && x.cmplt(end).all()) {
            return None;
        }
        let [nx, ny, _] = self.counts.map(|n| n as usize);
        Some((x.z as usize * ny + x.y as usize) * nx + x.x as usize)
    }

    #[inline(always)]
    pub fn number(&self, p: Vec3) -> Option<usize> {
        let number = *self.numbers.get(self.index(p)?)?;
        (number != EMPTY).then_some(number as usize)
    }

    /// Count of cells with surfaces.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Numbers (ids) of the six cells that share a face with `cell`. `None` for a neighbour without
    /// surfaces or outside of the grid.
    pub fn neighbours(&self, cell: usize) -> [Option<u32>; 6] {
        std::array::from_fn(|i| {
            let mut at = self.places[cell];
            let (axis, is_up) = (i / 2, i % 2 == 1);
            at[axis] = if is_up { at[axis] + 1 } else { at[axis].wrapping_sub(1) };
            if at[axis] >= self.counts[axis] {
                return None;
            }
            let [nx, ny, _] = self.counts;
            let number = self.numbers[((at[2] * ny + at[1]) * nx + at[0]) as usize];
            (number != EMPTY).then_some(number)
        })
    }

    /// Group of each numbered cell. A group is a block of up to 2 × 2 × 2 cells. Groups are
    /// numbered in the order of their first cells.
    pub fn groups(&self) -> Vec<usize> {
        let size = self.counts.map(|n| n.div_ceil(2) as usize);
        let mut numbers = vec![None; size.iter().product()];
        let mut count = 0;
        let group = |place: &[u32; 3]| {
            let [x, y, z] = place.map(|i| i as usize / 2);
            *numbers[(z * size[1] + y) * size[0] + x].get_or_insert_with(|| {
                count += 1;
                count - 1
            })
        };
        self.places.iter().map(group).collect()
    }

    /// Middle of cell `cell`, and the radius of a ball around the middle that encloses the cell.
    pub fn ball(&self, cell: usize) -> (Vec3, f32) {
        let size = 1.0 / self.scale;
        let place = Vec3::from_array(self.places[cell].map(|i| i as f32));
        (self.min + (place + 0.5) * size, 0.5 * 3f32.sqrt() * size)
    }

    /// Bytes of the arrays.
    pub fn bytes(&self) -> usize {
        size_of_val(self.numbers.as_slice()) + size_of_val(self.places.as_slice())
    }
}

/// Bounding box of `points` without the outermost points, with margins. Walls often have round
/// coordinates. The margins are therefore unusual fractions of the size, so that borders between
/// cells do not lie on walls. On a border, rounding errors would decide the cell of a point.
fn bounds_of_most(points: &[Vec3]) -> Option<Bounds3> {
    let outside = (points.len() as f64 * OUTSIDE) as usize;
    let mut bounds = Bounds3::EMPTY;
    for axis in 0..3 {
        let mut values: Vec<f32> = points.iter().map(|p| p[axis]).filter(|x| x.is_finite()).collect();
        values.sort_by(f32::total_cmp);
        bounds.min[axis] = *values.get(outside)?;
        bounds.max[axis] = *values.get(values.len().checked_sub(1 + outside)?)?;
    }
    let extent = (bounds.max - bounds.min).max_element();
    bounds.min -= 0.013 * extent;
    bounds.max += 0.029 * extent;
    (bounds.max - bounds.min).is_finite().then_some(bounds)
}

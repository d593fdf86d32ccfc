//! Contents of an OBJ file before triangulation: values of vertices, faces and changes of state
//! (material, smoothing group, part). Corners are stored as three lists of indices, of which unused
//! lists stay empty. So a mesh without texture coordinates and normals takes only 16 bytes per
//! triangle in addition to the text.

use super::libraries::LibraryName;
use super::remarks::Remarks;
use crate::geometry::{PartNames, UNNAMED};
use crate::io::FileError;
use crate::io::statements::possible_names;
use crate::math::{Vec2, Vec3};
use std::collections::HashSet;
use std::ops::Range;

/// Index for a missing value of a corner.
pub(super) const NONE: u32 = u32::MAX;

/// Colour of a position that has no colour in the file.
pub(super) const NO_COLOR: [f32; 4] = [f32::NAN; 4];

/// Contents of an OBJ file before triangulation.
pub(super) struct Outline {
    /// Values of all `v`, `vt` and `vn` lines.
    pub vertices: VertexData,
    /// Faces and changes of state, in the order of the file.
    pub sections: Vec<Section>,
    /// Lines and points, if they are rendered. Each is stored as a face of its vertices.
    pub wires: Vec<Section>,
    /// Names in `mtllib`.
    pub libraries: Vec<LibraryName>,
    /// Messages about faces that are left out, and about assumptions.
    pub remarks: Remarks,
    /// Errors for the first wrong statements of the file. The statements have been repaired:
    /// corners have no wrong indices, a wrong `vt` or `vn` is 0, and faces with a wrong `v` have
    /// been removed.
    pub wrong: Vec<FileError>,
    /// Number of all wrong statements.
    pub wrong_count: usize,
    /// Indices of wrong positions, sorted; empty after their faces have been removed.
    pub wrong_positions: Vec<usize>,
    /// Names of the parts of faces, including hidden parts.
    pub parts: PartNames,
}

impl Outline {
    /// Sections of faces, then sections of lines and points.
    pub fn all_sections(&self) -> impl Iterator<Item = &Section> {
        self.sections.iter().chain(&self.wires)
    }

    fn all_sections_mut(&mut self) -> impl Iterator<Item = &mut Section> {
        self.sections.iter_mut().chain(&mut self.wires)
    }

    /// Returns true if the file names a material.
    pub fn uses_materials(&self) -> bool {
        let mut states = self.all_sections().flat_map(|section| &section.state_changes);
        states.any(|state| state.material.is_some() || state.whole_name.is_some())
    }

    /// Names of the materials that faces may use.
    pub fn used_names(&self) -> HashSet<String> {
        let mut used = HashSet::new();
        let mut names: Vec<&str> = Vec::new();
        for (state, faces) in self.all_sections().flat_map(Section::states) {
            if state.material.is_some() || state.whole_name.is_some() {
                let whole = state.whole_name.iter().flat_map(|whole| possible_names(whole));
                names = whole.chain(state.material.as_deref()).collect();
            }
            if !faces.is_empty() {
                used.extend(names.drain(..).map(str::to_string));
            }
        }
        used
    }

    /// Possible names of materials that contain a `#`. Each of these `#` is perhaps the start of a
    /// comment instead.
    pub fn whole_names(&self) -> HashSet<String> {
        let states = self.sections.iter().flat_map(|section| &section.state_changes);
        let names = states.filter_map(|state| state.whole_name.as_deref());
        names.flat_map(possible_names).map(str::to_string).collect()
    }

    /// Replaces names of materials by their whole names, which include a `#`, if `defined` contains
    /// the whole names.
    pub fn set_whole_names(&mut self, defined: &HashSet<&str>) {
        for state in self.all_sections_mut().flat_map(|section| &mut section.state_changes) {
            let whole = state.whole_name.take();
            let mut names = whole.iter().flat_map(|whole| possible_names(whole));
            let name = names.find(|name| defined.contains(name)).map(str::to_string);
            state.material = name.or(state.material.take());
        }
    }
}

/// Values that corners of faces refer to by index.
#[derive(Default)]
pub(super) struct VertexData {
    /// Positions in units of the file.
    pub positions: Vec<Vec3>,
    /// Texture coordinates, v upwards.
    pub uvs: Vec<Vec2>,
    /// Unit normals; zero if the file's normal is invalid.
    pub normals: Vec<Vec3>,
    /// Colours of positions as in the file. A position without a colour has NaN. If the last
    /// positions have no colour, the list is shorter than the list of positions.
    pub colors: Vec<[f32; 4]>,
    /// Colours of `#MRGB` lines, in their order, from 0 to 1.
    pub mrgb: Vec<[f32; 4]>,
}

impl VertexData {
    /// Position of a corner of a section.
    pub fn position(&self, section: &Section, corner: usize) -> Vec3 {
        self.positions[section.v[corner] as usize]
    }

    /// Returns true if a corner of a section has a normal that is not zero.
    pub fn has_normal(&self, section: &Section, corner: usize) -> bool {
        let [_, _, vn] = section.corner(corner);
        vn != NONE && self.normals[vn as usize] != Vec3::ZERO
    }

    /// Sets the colour of the position that was added last.
    pub fn set_color(&mut self, color: [f32; 4]) {
        self.colors.resize(self.positions.len().saturating_sub(1), NO_COLOR);
        self.colors.push(color);
    }

    /// Appends the values of `more`.
    pub fn append(&mut self, more: &mut Self) {
        if !more.colors.is_empty() {
            self.colors.resize(self.positions.len(), NO_COLOR);
            self.colors.append(&mut more.colors);
        }
        self.mrgb.append(&mut more.mrgb);
        self.positions.append(&mut more.positions);
        self.uvs.append(&mut more.uvs);
        self.normals.append(&mut more.normals);
    }

    /// Number of positions, texture coordinates and normals.
    #[inline]
    pub fn counts(&self) -> [usize; 3] {
        [self.positions.len(), self.uvs.len(), self.normals.len()]
    }
}

/// Faces of a chunk of the file.
#[derive(Default)]
pub(super) struct Section {
    /// Number of corners of each face.
    sizes: Vec<u32>,
    /// Index of each corner's position.
    v: Vec<u32>,
    /// Index of each corner's texture coordinates, or [`NONE`]. Empty if no corner has texture
    /// coordinates.
    vt: Vec<u32>,
    /// Index of each corner's normal, or [`NONE`]. Empty if no corner has a normal.
    vn: Vec<u32>,
    /// Changes of the material and of the smoothing group, in order.
    state_changes: Vec<StateChange>,
    /// Changes of the part, in order. There may be one for each face.
    part_changes: Vec<PartChange>,
    /// Line of each face, if lines are kept.
    lines: Vec<u32>,
}

/// A change of the part of the faces.
#[derive(Clone, Copy)]
struct PartChange {
    /// First face of the part.
    face: u32,
    /// Index of the part in [`Outline::parts`].
    part: u32,
}

/// A change of the material or the smoothing group of the faces.
#[derive(Default)]
pub(super) struct StateChange {
    /// First face after the change.
    face: usize,
    /// First corner after the change.
    corner: usize,
    /// Line of the `usemtl`.
    pub line: usize,
    /// New material; `None` keeps the previous material.
    pub material: Option<String>,
    /// Name of the material if `#` and the text after it are not a comment but part of the name, as
    /// in `Paint #1`.
    pub whole_name: Option<String>,
    /// New smoothing group, 0 for none; `None` keeps the previous group.
    pub smoothing: Option<u32>,
}

/// Consecutive faces of a section, and the first corner of the first face.
#[derive(Clone)]
pub(super) struct FaceRange {
    faces: Range<usize>,
    corner: usize,
}

impl FaceRange {
    pub fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }
}

impl Section {
    /// Creates a section without faces, in which the material and the smoothing group before the
    /// section continue. The first change of state changes nothing, but the faces before the next
    /// change need one.
    pub fn of_unchanged_state() -> Self {
        let mut section = Self::default();
        section.state_change();
        section
    }

    /// Each change of state, with the faces up to the next change. The range of faces may be empty.
    pub fn states(&self) -> impl Iterator<Item = (&StateChange, FaceRange)> {
        let ends = self.state_changes.iter().skip(1).map(|next| next.face);
        let ends = ends.chain([self.sizes.len()]);
        self.state_changes.iter().zip(ends).map(|(state_change, end)| {
            let (faces, corner) = (state_change.face..end, state_change.corner);
            (state_change, FaceRange { faces, corner })
        })
    }

    /// Corners of each face, as indices for [`corner`](Self::corner).
    pub fn faces(&self, range: &FaceRange) -> impl Iterator<Item = Range<usize>> {
        let mut end = range.corner;
        self.sizes[range.faces.clone()].iter().map(move |&size| {
            let start = end;
            end += size as usize;
            start..end
        })
    }

    /// Part of each face.
    pub fn parts(&self, range: &FaceRange) -> impl Iterator<Item = u32> {
        let mut next = self
            .part_changes
            .partition_point(|change| change.face as usize <= range.faces.start);
        range.faces.clone().map(move |face| {
            while self
                .part_changes
                .get(next)
                .is_some_and(|change| change.face as usize <= face)
            {
                next += 1;
            }
            next.checked_sub(1).map_or(UNNAMED, |last| self.part_changes[last].part)
        })
    }

    /// Cuts `range` into ranges of faces whose parts have equal values of `of_part`.
    pub fn split_by(&self, range: &FaceRange, of_part: impl Fn(u32) -> u32) -> Vec<(u32, FaceRange)> {
        let mut ranges: Vec<(u32, FaceRange)> = Vec::new();
        let faces = range.faces.clone().zip(self.faces(range)).zip(self.parts(range));
        for ((face, corners), part) in faces {
            let value = of_part(part);
            match ranges.last_mut() {
                Some((last, range)) if *last == value => range.faces.end = face + 1,
                _ => {
                    let (faces, corner) = (face..face + 1, corners.start);
                    ranges.push((value, FaceRange { faces, corner }));
                }
            }
        }
        ranges
    }

    /// Cuts `range` into ranges of faces with texture coordinates (true) and without (false). A
    /// face has texture coordinates if any of its corners has.
    pub fn split_by_uvs(&self, range: FaceRange) -> Vec<(bool, FaceRange)> {
        let end = self.faces(&range).last().map_or(range.corner, |face| face.end);
        let uvs = part(&self.vt, range.corner..end);
        if uvs.is_empty() || !uvs.contains(&NONE) {
            return vec![(!uvs.is_empty(), range)];
        }
        let mut ranges: Vec<(bool, FaceRange)> = Vec::new();
        for (face, corners) in range.faces.clone().zip(self.faces(&range)) {
            let corner = corners.start;
            let has_uvs = part(&self.vt, corners).iter().any(|&vt| vt != NONE);
            match ranges.last_mut() {
                Some((last, range)) if *last == has_uvs => range.faces.end = face + 1,
                _ => {
                    let faces = face..face + 1;
                    ranges.push((has_uvs, FaceRange { faces, corner }));
                }
            }
        }
        ranges
    }

    /// Lines of the faces, if lines are kept.
    pub fn lines(&self, range: &FaceRange) -> impl Iterator<Item = usize> {
        let lines = self.lines.get(range.faces.clone()).unwrap_or_default();
        lines.iter().map(|&line| line as usize)
    }

    /// Indices of the positions of the corners `corners`.
    pub fn positions(&self, corners: Range<usize>) -> &[u32] {
        part(&self.v, corners)
    }

    /// Indices of the normals of `corners`, [`NONE`] for a missing normal; empty if all are
    /// missing.
    pub fn normals(&self, corners: Range<usize>) -> &[u32] {
        part(&self.vn, corners)
    }

    /// Indices of the texture coordinates of `corners`, [`NONE`] for missing coordinates; empty if
    /// all are missing.
    pub fn uvs(&self, corners: Range<usize>) -> &[u32] {
        part(&self.vt, corners)
    }

    /// Returns true if all of `corners` have texture coordinates.
    pub fn have_uvs(&self, corners: Range<usize>) -> bool {
        let uvs = part(&self.vt, corners);
        !uvs.is_empty() && !uvs.contains(&NONE)
    }

    /// Number of corners of each face.
    pub fn sizes(&self) -> &[u32] {
        &self.sizes
    }

    /// Returns true if a corner has texture coordinates.
    pub fn has_uvs(&self) -> bool {
        !self.vt.is_empty()
    }

    /// Replaces each face by triangles. `counts` has the number of triangles of each face. `v`,
    /// `vt` and `vn` have the indices of the corners of each triangle; `vt` may be empty. The line
    /// numbers of faces are removed.
    pub fn replace_faces(&mut self, counts: &[usize], [v, vt, vn]: [&[[u32; 3]]; 3]) {
        let mut starts = Vec::with_capacity(counts.len() + 1);
        let mut start = 0;
        for count in counts {
            starts.push(start);
            start += count;
        }
        starts.push(start);
        let place = |face: usize| starts.get(face).copied().unwrap_or(start);
        for change in &mut self.state_changes {
            change.face = place(change.face);
            change.corner = 3 * change.face;
        }
        for change in &mut self.part_changes {
            change.face = place(change.face as usize) as u32;
        }
        self.sizes = vec![3; v.len()];
        self.v = v.as_flattened().to_vec();
        self.vt = vt.as_flattened().to_vec();
        self.vn = vn.as_flattened().to_vec();
        self.lines = Vec::new();
    }

    /// Number of faces.
    #[inline]
    pub fn face_count(&self) -> usize {
        self.sizes.len()
    }

    /// Number of corners.
    #[inline]
    pub fn corner_count(&self) -> usize {
        self.v.len()
    }

    /// Indices of a corner's position, texture coordinates and normal.
    pub fn corner(&self, i: usize) -> [u32; 3] {
        let optional = |indices: &[u32]| indices.get(i).copied().unwrap_or(NONE);
        [self.v[i], optional(&self.vt), optional(&self.vn)]
    }

    /// Sets the position of a corner.
    pub fn set_position(&mut self, i: usize, index: u32) {
        self.v[i] = index;
    }

    /// Sets the normal of a corner.
    pub fn set_normal(&mut self, i: usize, index: u32) {
        self.vn.resize(self.v.len(), NONE);
        self.vn[i] = index;
    }

    /// Reverses the corners of a face.
    pub fn turn_over(&mut self, corners: Range<usize>) {
        for list in [&mut self.v, &mut self.vt, &mut self.vn] {
            if let Some(indices) = list.get_mut(corners.clone()) {
                indices.reverse();
            }
        }
    }

    /// Adds a corner by the indices of its position, texture coordinates and normal.
    #[inline]
    pub fn push_corner(&mut self, [v, vt, vn]: [u32; 3]) {
        push_optional(&mut self.vt, vt, self.v.len());
        push_optional(&mut self.vn, vn, self.v.len());
        self.v.push(v);
    }

    /// Adds a face of the last `size` corners, with its `line` if given.
    #[inline]
    pub fn push_face(&mut self, size: u32, line: Option<u32>) {
        self.sizes.push(size);
        self.lines.extend(line);
    }

    /// Reserves memory for `count` changes of the part.
    pub fn reserve_parts(&mut self, count: usize) {
        self.part_changes.reserve_exact(count);
    }

    /// Assigns the part `part` to all faces from index `face` on.
    pub fn begin_part(&mut self, face: u32, part: u32) {
        // Remove the previous part if it has no visible face.
        if self.part_changes.last().is_some_and(|last| last.face == face) {
            self.part_changes.pop();
        }
        if part != self.part_changes.last().map_or(UNNAMED, |last| last.part) {
            self.part_changes.push(PartChange { face, part });
        }
    }

    /// Removes all corners after the first `len`.
    pub fn truncate(&mut self, len: usize) {
        self.v.truncate(len);
        self.vt.truncate(len);
        self.vn.truncate(len);
    }

    /// Removes faces with a position for which `is_wrong` returns true. Returns their lines, if
    /// lines are kept.
    pub fn remove_faces(&mut self, is_wrong: impl Fn(u32) -> bool) -> Vec<usize> {
        let mut old = std::mem::take(self);
        let mut state_changes = std::mem::take(&mut old.state_changes).into_iter().peekable();
        let parts: Vec<u32> = old.parts(&old.all_faces()).collect();
        let mut removed = Vec::new();
        let mut end = 0;
        for (face, &size) in old.sizes.iter().enumerate() {
            while let Some(state_change) = state_changes.next_if(|state_change| state_change.face == face) {
                self.push_state_change(state_change);
            }
            let corners = end..end + size as usize;
            end = corners.end;
            let line = old.lines.get(face).copied();
            if part(&old.v, corners.clone()).iter().any(|&i| is_wrong(i)) {
                removed.extend(line.map(|line| line as usize));
                continue;
            }
            corners.for_each(|i| self.push_corner(old.corner(i)));
            self.begin_part(self.sizes.len() as u32, parts[face]);
            self.push_face(size, line);
        }
        state_changes.for_each(|state_change| self.push_state_change(state_change));
        removed
    }

    /// All faces.
    pub fn all_faces(&self) -> FaceRange {
        FaceRange {
            faces: 0..self.sizes.len(),
            corner: 0,
        }
    }

    /// Adds a change of state before the next face.
    fn push_state_change(&mut self, state_change: StateChange) {
        self.state_changes.push(StateChange {
            face: self.sizes.len(),
            corner: self.v.len(),
            ..state_change
        });
    }

    /// Returns the change of state before the next face. Adds a change if there is none.
    pub fn state_change(&mut self) -> &mut StateChange {
        let (face, corner) = (self.sizes.len(), self.v.len());
        if self.state_changes.last().is_none_or(|last| last.face != face) {
            self.state_changes.push(StateChange {
                face,
                corner,
                ..StateChange::default()
            });
        }
        let last = self.state_changes.len() - 1;
        &mut self.state_changes[last]
    }

    /// Frees unused memory of the lists.
    pub fn shrink_to_fit(&mut self) {
        self.sizes.shrink_to_fit();
        self.v.shrink_to_fit();
        self.vt.shrink_to_fit();
        self.vn.shrink_to_fit();
        self.lines.shrink_to_fit();
        self.part_changes.shrink_to_fit();
    }
}

/// Appends the index of a corner to a list with one index for each corner. `count` corners come
/// before this corner. The list stays empty until the first index that is not [`NONE`]. The earlier
/// corners then get [`NONE`].
fn push_optional(indices: &mut Vec<u32>, index: u32, count: usize) {
    if index != NONE && indices.is_empty() {
        indices.resize(count, NONE);
    }
    if index != NONE || !indices.is_empty() {
        indices.push(index);
    }
}

/// The elements of a list in `range`. Empty if the list is empty.
fn part(indices: &[u32], range: Range<usize>) -> &[u32] {
    &indices[range.start.min(indices.len())..range.end.min(indices.len())]
}

//! Faces read by both readers.

use super::plain::{PlainFace, PlainObj};
use super::{ComparedFile, Kind, Wrong};
use crate::geometry::{Mesh, triangle_normal};
use crate::io::area_vector;
use crate::io::obj::{Face, ObjFaces, ObjFile};
use crate::io::tobj_reader::Part;
use crate::math::{DVec3, Vec2, Vec3, excerpt, list};

/// Share of a polygon's extent squared that the areas of two cuts may differ by, by roundings of f64.
const ROUNDING: f64 = 1e-9;

/// What the own reader says of a file, and what its statements are.
pub(super) struct Shape<'a> {
    pub own: &'a ObjFile,
    /// Faces with their lines, in the file's order.
    pub faces: &'a ObjFaces,
    pub plain: &'a PlainObj,
    pub wrong: &'a Wrong,
    /// Whether tobj refuses a library in which the own reader finds a wrong statement.
    pub are_libraries_refused: bool,
}

/// A corner of a triangle.
#[derive(Clone, Copy)]
struct Corner {
    p: Vec3,
    uv: Option<Vec2>,
    normal: Option<Vec3>,
}

/// What of two corners differs.
enum Difference {
    Position,
    Uv,
    Normal,
}

/// Triangles of parts, in the file's order.
struct Triangles<'a> {
    parts: &'a [Part],
    part: usize,
    next: usize,
}

impl<'a> Triangles<'a> {
    /// The part of the next triangles, and their corners.
    fn take(&mut self, count: usize) -> Option<(&'a Part, Vec<[Corner; 3]>)> {
        while self.parts.get(self.part)?.mesh.triangles.len() <= self.next {
            (self.part, self.next) = (self.part + 1, 0);
        }
        let part = &self.parts[self.part];
        let triangles = part.mesh.triangles.get(self.next..self.next + count)?;
        self.next += count;
        Some((part, triangles.iter().map(|t| corners(&part.mesh, t)).collect()))
    }
}

fn corners(mesh: &Mesh, triangle: &[u32; 3]) -> [Corner; 3] {
    triangle.map(|v| Corner {
        p: mesh.positions[v as usize],
        uv: mesh.uvs.get(v as usize).copied(),
        normal: mesh.normals.get(v as usize).copied(),
    })
}

impl Shape<'_> {
    /// Compares all faces with the triangles of tobj.
    pub fn compare(&self, parts: &[Part], report: &mut ComparedFile) {
        let said: usize = self.plain.faces.iter().map(|face| face.corners - 2).sum();
        let read: usize = parts.iter().map(|part| part.mesh.triangles.len()).sum();
        if said != read {
            report.differs(
                0,
                format!("the faces have {said} triangles, of which tobj reads {read}"),
            );
            return;
        }
        let mut of_tobj = Triangles {
            parts,
            part: 0,
            next: 0,
        };
        let mut cursors = vec![0; self.own.groups.len()];
        let mut own_faces = self.faces.faces().peekable();
        for plain in &self.plain.faces {
            while let Some(face) = own_faces.next_if(|face| face.line < plain.line) {
                self.take_own(&face, &mut cursors);
                report.differs(face.line, "tobj does not read this face".into());
            }
            let Some((part, triangles)) = of_tobj.take(plain.corners - 2) else {
                return report.differs(plain.line, "tobj cuts this face in two parts".into());
            };
            let Some(face) = own_faces.next_if(|face| face.line == plain.line) else {
                // The own reader leaves out faces with wrong positions; tobj reads NaN.
                let has_wrong_position = || {
                    let mut corners = triangles.iter().flatten();
                    self.wrong.is_wrong() && corners.any(|corner| !corner.p.is_finite())
                };
                match self.wrong.has(plain.line..=plain.line) || has_wrong_position() {
                    true => report.explained.add(Kind::WrongStatement, plain.line),
                    false => report.differs(plain.line, "the own reader does not read this face".into()),
                }
                continue;
            };
            report.triangles += triangles.len() as u64;
            self.compare_material(&face, part, report);
            let Some(own) = self
                .take_own(&face, &mut cursors)
                .filter(|own| own.len() == triangles.len())
            else {
                report.differs(plain.line, format!("the face has not {} triangles", triangles.len()));
                continue;
            };
            self.compare_triangles(plain, &own, &triangles, report);
        }
        for face in own_faces {
            report.differs(face.line, "tobj does not read this face".into());
        }
        for (group, cursor) in self.own.groups.iter().zip(cursors) {
            if group.mesh.triangles.len() != cursor {
                let name = group.material.as_deref().unwrap_or("");
                let more = group.mesh.triangles.len() - cursor;
                report.differs(
                    group.line,
                    format!("the own mesh of `{}` has {more} triangles of no face", excerpt(name)),
                );
            }
        }
    }

    /// The triangles of a face in the own reader's mesh; `None` where it has fewer.
    fn take_own(&self, face: &Face, cursors: &mut [usize]) -> Option<Vec<[Corner; 3]>> {
        let count = face.positions.len().saturating_sub(2);
        let mesh = &self.own.groups.get(face.material)?.mesh;
        let cursor = cursors.get_mut(face.material)?;
        let triangles = mesh.triangles.get(*cursor..*cursor + count)?;
        *cursor += count;
        Some(triangles.iter().map(|t| corners(mesh, t)).collect())
    }

    fn compare_material(&self, face: &Face, part: &Part, report: &mut ComparedFile) {
        let own = self
            .own
            .groups
            .get(face.material)
            .and_then(|group| group.material.as_deref());
        let of_tobj = part.material.as_deref();
        if own == of_tobj {
            return;
        }
        if let (Some(name), None) = (own, of_tobj) {
            let uses = &self.plain.uses;
            let used = uses[..uses.partition_point(|&(_, line)| line < face.line)].last();
            let is_late = used.is_some_and(|(_, used)| self.plain.libraries.iter().any(|line| line > used));
            match self.own.material(name) {
                None => return report.explained.add(Kind::UndefinedMaterial, face.line),
                Some(_) if self.are_libraries_refused => {
                    return report.explained.add(Kind::WrongStatement, face.line);
                }
                Some(_) if is_late => return report.explained.add(Kind::LateLibrary, face.line),
                Some(_) => {}
            }
        }
        let [own, of_tobj] =
            [own, of_tobj].map(|name| name.map_or("none".into(), |name| format!("`{}`", excerpt(name))));
        report.differs(
            face.line,
            format!("the material of the face is {own} and by tobj {of_tobj}"),
        );
    }

    /// Compares the triangles of a face: those of tobj are a fan.
    fn compare_triangles(
        &self,
        plain: &PlainFace,
        own: &[[Corner; 3]],
        fan: &[[Corner; 3]],
        report: &mut ComparedFile,
    ) {
        let Some(first) = fan.first() else { return };
        let polygon: Vec<Corner> = first[..2].iter().chain(fan.iter().map(|t| &t[2])).copied().collect();
        let mut notes = FaceNotes::default();
        let mut difference = None;
        // In most faces triangles and corners come in one order.
        for (triangle, expected) in own.iter().zip(fan) {
            for corner in 0..3 {
                let found = self.compare_corner(plain, triangle, corner, &expected[corner], &mut notes);
                if let (Err(what), None) = (found, &difference) {
                    difference = Some((what, triangle[corner], expected[corner]));
                }
            }
        }
        if difference.is_some() && own.len() > 1 {
            // Else each corner must be one of the polygon's, and the triangles must fill the polygon.
            notes = FaceNotes::default();
            let mut is_cut_of = |triangle: &[Corner; 3]| {
                (0..3).all(|corner| {
                    let mut of_polygon = polygon.iter();
                    of_polygon.any(|expected| {
                        self.compare_corner(plain, triangle, corner, expected, &mut notes)
                            .is_ok()
                    })
                })
            };
            if own.iter().all(&mut is_cut_of) && self.have_same_area(own, fan) {
                report.explained.add(Kind::PolygonCut, plain.line);
                difference = None;
            }
        }
        match difference {
            Some((what, own, of_tobj)) => report.differs(plain.line, words(&what, &own, &of_tobj)),
            None => notes.tell(plain, report),
        }
    }

    /// Whether triangles have the same area vector in all: that of a polygon does not depend on how it is cut.
    fn have_same_area(&self, own: &[[Corner; 3]], fan: &[[Corner; 3]]) -> bool {
        let area =
            |triangles: &[[Corner; 3]]| -> DVec3 { triangles.iter().map(|t| area_vector(&t.map(|c| c.p))).sum() };
        let Some(first) = fan.first() else { return true };
        let from_first = |corner: &Corner| (corner.p.as_dvec3() - first[0].p.as_dvec3()).length_squared();
        let extent = fan.iter().flatten().map(from_first).fold(0.0, f64::max);
        // Values that are not finite count as the same.
        let error = (area(own) - area(fan)).length();
        error.is_nan() || error <= ROUNDING * extent * own.len() as f64
    }

    /// Compares a corner of an own triangle with one of tobj.
    fn compare_corner(
        &self,
        plain: &PlainFace,
        triangle: &[Corner; 3],
        corner: usize,
        of_tobj: &Corner,
        notes: &mut FaceNotes,
    ) -> Result<(), Difference> {
        let own = &triangle[corner];
        if !are_same(&own.p.to_array(), &of_tobj.p.to_array()) {
            return Err(Difference::Position);
        }
        match (own.uv, of_tobj.uv) {
            (Some(a), Some(b)) if are_same(&a.to_array(), &b.to_array()) => {}
            (None, None) | (Some(Vec2::ZERO), None) => {}
            (Some(_), None) if plain.is_mixed => notes.is_mixed = true,
            _ => return Err(Difference::Uv),
        }
        match (own.normal, of_tobj.normal) {
            (Some(a), Some(b)) if are_same(&a.to_array(), &b.to_array()) => {}
            (None, None) => {}
            (Some(normal), None) => {
                let [a, b, c] = triangle.map(|corner| corner.p);
                let flat = triangle_normal(a, b, c);
                let flat = if flat == Vec3::ZERO { Vec3::Z } else { flat };
                if !are_same(&normal.to_array(), &flat.to_array()) {
                    match (plain.is_smooth, plain.is_mixed) {
                        (true, _) => notes.is_smooth = true,
                        (_, true) => notes.is_mixed = true,
                        _ => return Err(Difference::Normal),
                    }
                }
            }
            _ => return Err(Difference::Normal),
        }
        Ok(())
    }
}

/// What explains the differences of a face.
#[derive(Default)]
struct FaceNotes {
    is_smooth: bool,
    is_mixed: bool,
}

impl FaceNotes {
    fn tell(&self, plain: &PlainFace, report: &mut ComparedFile) {
        let notes = [
            (self.is_smooth, Kind::SmoothingGroup),
            (self.is_mixed, Kind::MixedCorners),
        ];
        for (_, kind) in notes.into_iter().filter(|(is_so, _)| *is_so) {
            report.explained.add(kind, plain.line);
        }
    }
}

fn are_same(a: &[f32], b: &[f32]) -> bool {
    a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

fn words(what: &Difference, own: &Corner, of_tobj: &Corner) -> String {
    let optional = |values: Option<&[f32]>| values.map_or("missing".into(), list);
    let uv = |corner: &Corner| optional(corner.uv.map(|uv| uv.to_array()).as_ref().map(|uv| &uv[..]));
    let normal = |corner: &Corner| optional(corner.normal.map(|n| n.to_array()).as_ref().map(|n| &n[..]));
    let (name, [a, b]) = match what {
        Difference::Position => ("positions", [own, of_tobj].map(|corner| list(&corner.p.to_array()))),
        Difference::Uv => ("texture coordinates", [own, of_tobj].map(uv)),
        Difference::Normal => ("normals", [own, of_tobj].map(normal)),
    };
    format!("{name} of a corner are {a} and by tobj {b}")
}

//! Placements of objects in a scene file: one placement or several instances, with or without
//! motion.

use super::input::read_text;
use super::section::value;
use super::statements::uncommented;
use super::{FileError, Instances, ObjectSection, Position, Scale, SceneFile, TransformSection};
use crate::geometry::Placement;
use crate::math::{Affine3A, Quat, Vec3, affine_from_rows, affine_from_trs, excerpt};
use std::ops::Range;
use std::path::Path;
use toml::Spanned;

/// Maximum rotation in degrees between two steps of a motion. Between two steps, a rotating point
/// moves on a straight line. The distance of this line from the circle is at most 1/2900 of the
/// radius.
const DEGREES_A_STEP: f32 = 3.0;

/// Placement of an object in the scene.
#[derive(Clone, Debug)]
pub(super) enum ObjectPlacement {
    /// No transform: the coordinates of the OBJ file are used.
    AsItIs,
    /// One transform, without motion.
    Once(Affine3A),
    /// Motion, or several copies.
    Instances(Vec<Placement>),
}

impl ObjectPlacement {
    /// All placements, in the form that instances need.
    pub fn into_placements(self) -> Vec<Placement> {
        match self {
            Self::AsItIs => vec![Placement::Still(Affine3A::IDENTITY)],
            Self::Once(placement) => vec![Placement::Still(placement)],
            Self::Instances(placements) => placements,
        }
    }
}

/// Computes the placement of `object` from its keys.
pub(super) fn place(file: &SceneFile, object: &ObjectSection) -> Result<ObjectPlacement, FileError> {
    let open = given(file, &object.transform, &object.matrix, "transform", "matrix")?;
    let close = given(
        file,
        &object.transform_close,
        &object.matrix_close,
        "transform_close",
        "matrix_close",
    )?;
    let own = match (open, close) {
        (None, None) => None,
        (Some(open), None) => Some(Placement::Still(open.affine())),
        (open, Some(close)) => Some(motion(open.unwrap_or(PlacementForm::IDENTITY), close)),
    };
    let Some(instances) = &object.instances else {
        return Ok(match own {
            None => ObjectPlacement::AsItIs,
            Some(Placement::Still(placement)) => ObjectPlacement::Once(placement),
            Some(moving) => ObjectPlacement::Instances(vec![moving]),
        });
    };

    // The placement of the object transforms all its instances
    let own = own.unwrap_or(Placement::Still(Affine3A::IDENTITY));
    let of_instance = |instance: Affine3A| match &own {
        Placement::Still(placement) => Placement::Still(*placement * instance),
        Placement::Moving(steps) => Placement::Moving(steps.iter().map(|step| *step * instance).collect()),
    };
    let placements = read_instances(file, instances)?;
    Ok(ObjectPlacement::Instances(
        placements.into_iter().map(of_instance).collect(),
    ))
}

/// A placement as given in a scene file.
#[derive(Clone, Copy)]
enum PlacementForm {
    Parts { translate: Vec3, rotate: Vec3, scale: Vec3 },
    Matrix(Affine3A),
}

impl PlacementForm {
    const IDENTITY: Self = Self::Parts {
        translate: Vec3::ZERO,
        rotate: Vec3::ZERO,
        scale: Vec3::ONE,
    };

    fn of(section: &TransformSection) -> Self {
        let [translate, rotate] = [&section.translate, &section.rotate].map(|v| value(v).unwrap_or_default().into());
        let scale = value(&section.scale).map_or(Vec3::ONE, Scale::factors);
        Self::Parts {
            translate,
            rotate,
            scale,
        }
    }

    fn affine(&self) -> Affine3A {
        match *self {
            Self::Parts {
                translate,
                rotate,
                scale,
            } => affine_from_trs(translate, rotate, scale),
            Self::Matrix(matrix) => matrix,
        }
    }
}

/// Motion from one placement to another. Translation, angles and scale change linearly, so that an
/// object may turn more than once. Matrices that only scale, rotate and translate turn along the
/// shorter arc. Other matrices change linearly, element by element.
fn motion(open: PlacementForm, close: PlacementForm) -> Placement {
    let steps_of = |degrees: f32| ((degrees / DEGREES_A_STEP).ceil() as usize).clamp(1, Placement::MAX_STEPS - 1);
    let along = |count: usize, at: &dyn Fn(f32) -> Affine3A| {
        Placement::Moving((0..=count).map(|i| at(i as f32 / count as f32)).collect())
    };
    if let (
        PlacementForm::Parts {
            translate: t0,
            rotate: r0,
            scale: s0,
        },
        PlacementForm::Parts {
            translate: t1,
            rotate: r1,
            scale: s1,
        },
    ) = (open, close)
    {
        let turn = (r1 - r0).abs().element_sum();
        return along(steps_of(turn), &|t| {
            affine_from_trs(t0.lerp(t1, t), r0.lerp(r1, t), s0.lerp(s1, t))
        });
    }
    let (open, close) = (open.affine(), close.affine());
    match (decomposed(&open), decomposed(&close)) {
        (Some((s0, r0, t0)), Some((s1, r1, t1))) => {
            let turn = r0.angle_between(r1).to_degrees();
            along(steps_of(turn), &|t| {
                let (scale, translate) = (s0.lerp(s1, t), t0.lerp(t1, t));
                Affine3A::from_scale_rotation_translation(scale.into(), r0.slerp(r1, t), translate.into())
            })
        }
        _ => Placement::Moving([open, close].into()),
    }
}

/// Scale, rotation and translation of a matrix; `None` if the matrix has shear.
fn decomposed(m: &Affine3A) -> Option<(Vec3, Quat, Vec3)> {
    let (scale, rotation, translation) = m.to_scale_rotation_translation();
    let again = Affine3A::from_scale_rotation_translation(scale, rotation, translation);
    let size = m.matrix3.to_cols_array().iter().fold(0f32, |size, x| size.max(x.abs()));
    again
        .matrix3
        .abs_diff_eq(m.matrix3, 1e-5 * size)
        .then(|| (scale.into(), rotation, translation.into()))
}

/// Placement from the key `transform` or the key `matrix`.
fn given(
    file: &SceneFile,
    transform: &Option<Spanned<TransformSection>>,
    matrix: &Option<Spanned<[[f32; 4]; 4]>>,
    transform_key: &str,
    matrix_key: &str,
) -> Result<Option<PlacementForm>, FileError> {
    let (given, span) = match (transform, matrix) {
        (None, None) => return Ok(None),
        (Some(_), Some(matrix)) => {
            return Err(file
                .error(
                    matrix.span(),
                    format!("both `{transform_key}` and `{matrix_key}` are given"),
                )
                .help("keep one of them"));
        }
        (Some(section), None) => (PlacementForm::of(section.get_ref()), section.span()),
        (None, Some(matrix)) => {
            let affine = affine_from_rows(*matrix.get_ref()).ok_or_else(|| last_row(file, matrix.span()))?;
            (PlacementForm::Matrix(affine), matrix.span())
        }
    };
    if let Some((message, help)) = fault("the object", &given.affine()) {
        return Err(file.error(span, format!("the transform {message}")).help(help));
    }
    Ok(Some(given))
}

fn last_row(file: &SceneFile, span: Range<usize>) -> FileError {
    file.error(span, "the last row of a placement must be 0 0 0 1")
        .help("give the matrix row by row")
}

fn is_placement(m: &Affine3A) -> bool {
    fault("the object", m).is_none()
}

/// Returns a reason and help if the placement of `what` cannot be inverted.
pub(super) fn fault(what: &str, m: &Affine3A) -> Option<(String, &'static str)> {
    let determinant = m.matrix3.determinant();
    if !m.is_finite() {
        return Some(("is not finite".into(), "give finite numbers"));
    }
    // Use doubles: they distinguish a flat placement from a placement that is too small or too
    // large for floats
    let factor = m.matrix3.as_dmat3().determinant().abs().cbrt();
    let is_beyond = determinant == 0.0 || !determinant.is_finite();
    is_beyond.then(|| match factor {
        0.0 => (format!("flattens {what}"), "scale factors must not be zero"),
        _ => (
            format!("scales {what} by about {factor:.0e}, which cannot be inverted in 32-bit floats"),
            "use factors from 1e-12 to 1e12, or scale the OBJ file itself",
        ),
    })
}

fn read_instances(file: &SceneFile, instances: &Spanned<Instances>) -> Result<Vec<Affine3A>, FileError> {
    let list = match instances.get_ref() {
        Instances::Matrices(list) => list,
        Instances::File(name) => {
            let path = file.resolve(name);
            let text = read_text(&path, "the list of instances")
                .map_err(|error| error.help_if_none("give a text file; its path is relative to the scene file"))?;
            return parse_instances(&path, &text);
        }
    };
    let read = |(i, rows): (usize, &[[f32; 4]; 4])| {
        let affine = affine_from_rows(*rows).ok_or_else(|| last_row(file, instances.span()))?;
        if is_placement(&affine) {
            Ok(affine)
        } else {
            Err(file
                .error(
                    instances.span(),
                    format!("instance {} is flattened or not finite", i + 1),
                )
                .help("give matrices that can be inverted"))
        }
    };
    list.iter().enumerate().map(read).collect()
}

/// Parses placements, one on each line: the first three rows of a matrix, or all four rows.
fn parse_instances(path: &Path, text: &str) -> Result<Vec<Affine3A>, FileError> {
    let mut placements = Vec::new();
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let line = uncommented(line);
        if line.is_empty() {
            continue;
        }
        let wrong = |message: String| {
            FileError::new(path, message).at(Position::line(index + 1)).help(
                "a line has the matrix of one placement, row by row: twelve numbers, or sixteen that end with 0 0 0 1",
            )
        };
        let mut rows = [[0.0, 0.0, 0.0, 1.0]; 4];
        let mut count = 0;
        for word in line
            .split(|c: char| c.is_whitespace() || c == ',')
            .filter(|w| !w.is_empty())
        {
            let number = word
                .parse::<f32>()
                .map_err(|_| wrong(format!("`{}` is not a number", excerpt(word))))?;
            if let Some(place) = rows.as_flattened_mut().get_mut(count) {
                *place = number;
            }
            count += 1;
        }
        if count != 12 && count != 16 {
            return Err(wrong(format!("the line has {count} numbers, not 12 or 16")));
        }
        let affine = affine_from_rows(rows).ok_or_else(|| wrong("the last row is not 0 0 0 1".into()))?;
        if !is_placement(&affine) {
            return Err(wrong("the placement flattens the object or is not finite".into()));
        }
        placements.push(affine);
    }
    if placements.is_empty() {
        return Err(FileError::new(path, "no instances in this file").help("write one placement in each line"));
    }
    Ok(placements)
}

//! Documented differences between both readers.

use crate::io::MAX_PLACES;
use std::collections::BTreeMap;

/// Defines the kinds with their names and words.
macro_rules! kinds {
    ($($kind:ident, $code:literal, $words:literal;)*) => {
        /// A documented difference between the own reader and tobj.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Kind {
            $(#[doc = $words] $kind,)*
        }

        impl Kind {
            /// All kinds.
            pub const ALL: &[Self] = &[$(Self::$kind),*];

            /// A name that stays the same, whatever the words.
            pub fn code(self) -> &'static str {
                match self { $(Self::$kind => $code,)* }
            }

            /// The difference in a sentence.
            pub fn words(self) -> &'static str {
                match self { $(Self::$kind => $words,)* }
            }
        }
    };
}

kinds! {
    PolygonCut, "polygon-cut", "polygons that are not convex are cut by clipping ears; tobj cuts all polygons as fans";
    SmoothingGroup, "smoothing-group", "smoothing groups give normals where the file has none; tobj does not support smoothing groups";
    MixedCorners, "mixed-corners", "corners without texture coordinates or normals stand beside corners with them; tobj's lists lose their order there";
    BadNormal, "bad-normal", "normals that are zero or not finite count as missing; tobj takes them as they are";
    Continuation, "continued-line", "a \\ at the end of a line continues it; tobj does not support continued lines";
    TrailingComment, "comment", "comments may follow a statement; tobj reads them as a part of it";
    ByteOrderMark, "byte-order-mark", "a byte-order mark is skipped; tobj loses the first statement";
    Encoding, "encoding", "texts that are not in UTF-8 are read; tobj refuses them";
    LineEnds, "line-ends", "lines may end with CR alone; tobj takes the file as one line";
    KeywordBlanks, "keyword-blanks", "names may follow a tab, and lines may be indented; tobj takes the name from the first blank of the line on";
    KeywordCase, "keyword-case", "keywords of MTL are known in any case; tobj knows one spelling";
    Nameless, "nameless", "materials and libraries may have no name; tobj refuses them";
    LibraryName, "library-name", "libraries are found whatever the case and the separators of their names, several on a line, in other folders, and by the name of the OBJ file; tobj takes the very name";
    LateLibrary, "late-library", "a library may be named after its materials are used; tobj knows those named before";
    UndefinedMaterial, "undefined-material", "faces keep the name of a material that no library defines; tobj gives them none";
    ForwardReference, "forward-reference", "faces may name vertices that come later in the file; tobj knows those so far";
    VertexWeight, "vertex-weight", "the fourth number of a vertex, a weight, has no effect; tobj divides by it";
    VertexValues, "vertex-values", "vertices may have any number of further values; tobj refuses five, seven and more";
    VertexColor, "vertex-colour", "some vertices may have colours; tobj needs them on all vertices or on none";
    ShortTexture, "short-texture-coordinate", "texture coordinates may be one number; tobj needs two";
    NumberWord, "number-word", "values such as 1.#QNAN count as missing; tobj refuses them";
    OldFace, "fo", "fo is another word for f; tobj does not know it";
    Polyline, "polyline", "lines (l) have no effect; tobj makes triangles of those of three points and more";
    ShortFace, "short-face", "faces of fewer than three corners have no effect; tobj refuses invalid ones";
    GreyColor, "grey-colour", "a colour may be one number; tobj panics";
    XyzColor, "xyz-colour", "colours may be CIE XYZ; tobj refuses them";
    AmbientWords, "ambient", "Ka and map_Ka have no effect; tobj refuses values that are not a colour or a name";
    NumberOptions, "number-options", "options may stand before a number (d -halo 0.5); tobj refuses them";
    WrongStatement, "wrong-statement", "a wrong statement is left out, or a part of it; tobj takes it";
BeforeMaterial, "before-material", "statements before the first newmtl have no effect; tobj refuses invalid ones";
}

/// Lines in which a difference is found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Lines {
    /// Number of places.
    pub count: u64,
    /// The first lines.
    pub first: Vec<usize>,
}

impl Lines {
    /// Notes one more line.
    pub fn add(&mut self, line: usize) {
        self.count += 1;
        if self.first.len() <= MAX_PLACES {
            self.first.push(line);
        }
    }

    /// Adds the differences of `more`.
    pub fn extend(&mut self, more: &Self) {
        self.count += more.count;
        let free = (1 + MAX_PLACES).saturating_sub(self.first.len());
        self.first.extend(more.first.iter().take(free));
    }
}

/// Differences that are explained, by kind.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Notes(pub BTreeMap<Kind, Lines>);

impl Notes {
    /// Notes a difference in this line.
    pub fn add(&mut self, kind: Kind, line: usize) {
        self.0.entry(kind).or_default().add(line);
    }

    /// Adds those of another list.
    pub fn extend(&mut self, more: &Self) {
        for (&kind, lines) in &more.0 {
            self.0.entry(kind).or_default().extend(lines);
        }
    }
}

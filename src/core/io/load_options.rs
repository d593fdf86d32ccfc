use super::mtl::LibraryOptions;
use super::origin::Origin;
use super::part_filter::PartFilter;
use super::{MtlDialect, Severity, Subdivision};
use crate::parameter::{Named, Range, named, parameters};
use crate::scene::{CutLight, Panes};
use crate::texture::TextureFilter;

parameters! {
    /// Parameters of reading files, for choices that the formats leave open.
    pub struct LoadParameters, heading "", values values {
        /// Dialect of MTL files: the program that wrote them
        ///
        /// `auto` recognises the program; `spec` reads the statements literally.
        mtl_dialect: MtlDialect = MtlDialect::Auto;
        /// Reader of OBJ and MTL files: own, or the crate tobj
        ///
        /// See docs/guide/reference/obj-mtl.md.
        obj_reader: ObjReader = ObjReader::Own;
        /// Smooth edges below this angle in degrees, ignoring the file's normals
        smooth: f32, default "normals of the file", in Range::Above(0.0);
        /// Steps of subdivision of all objects: 0 to 12, or pixels:W for edges of W pixels
        ///
        /// Each step divides a face into four. The mesh approaches a smooth surface: the surface of
        /// Loop if all faces are triangles, that of Catmull and Clark otherwise. `pixels:1.5` makes
        /// the smallest number of steps after which edges are at most 1.5 pixels long, as seen from
        /// the camera.
        subdivision: Subdivision = Subdivision::Steps(0), flag "subdivide";
        /// Keep edges between faces sharp above this angle in degrees
        ///
        /// For subdivision. A vertex keeps its position if the sharp curve through it turns by more
        /// than this angle.
        crease_angle: f32, default "no sharp edges", in Range::Between(0.0, 180.0);
        /// Render lines and points as tubes and spheres of this diameter
        ///
        /// `l` and `p` statements, in units of the OBJ file.
        line_width: f32, default "lines and points are not rendered", in Range::Above(0.0);
        /// Displacement of surfaces by textures: on, off, or auto
        ///
        /// `auto` displaces by the `displacement_map` of a scene file, and by `disp` of a library
        /// if the object is subdivided.
        displacement: DisplacementUse = DisplacementUse::Auto;
        /// Colours of vertices: on, off, or auto
        ///
        /// They multiply the diffuse or base colour. `auto` uses them if no texture gives that
        /// colour, and if they are not the grey that exporters write by default.
        vertex_colors: VertexColors = VertexColors::Auto;
        /// Encoding of the colours of vertices: srgb, or linear
        vertex_color_space: VertexColorSpace = VertexColorSpace::Srgb;
        /// Find textures by file names, for materials that name no texture: auto, or off
        ///
        /// `auto` takes `NAME_basecolor`, `NAME_roughness` and so on beside the OBJ file, if
        /// exactly one set fits the name of the material or of the file. Without a library it takes
        /// the only picture with the name of the OBJ file.
        maps_by_name: MapsByName = MapsByName::Auto;
        /// Texture filter: mip, or bilinear in the finest level
        texture_filter: TextureFilter = TextureFilter::Mip;
        /// Light through thin glass and window panes: straight, or refracted
        ///
        /// `straight`: shadow rays pass through panes, and flat panes count as thin. `refract`:
        /// only scattered rays find the light, and panes are bodies.
        panes: Panes = Panes::Straight;
        /// Light of a scene that sections cut: cut, or whole
        ///
        /// `whole`: only camera rays see the cuts, and light meets the whole scene. Caps are black.
        cut_light: CutLight = CutLight::Cut;
        /// Caps that close the cuts of sections: on, or off
        cut_caps: CutCaps = CutCaps::On;
        /// Point of the OBJ file's coordinates that becomes the origin: X,Y,Z, auto or off
        ///
        /// The point is subtracted before coordinates are rounded to 32 bits. `auto` chooses a
        /// point if the file lies far from its own origin. Positions in a scene file and in the
        /// channels `P` are relative to the point. Positions in flags, and positions that `info`
        /// and `paths` print, are coordinates of the OBJ file.
        origin: Origin = Origin::Off, default "off; auto for a bare OBJ";
        /// Unit of the OBJ file: auto, mm, cm, m, in or ft
        ///
        /// Heights of eyes, drawings to scale, stereo pictures and f-numbers use it. Lengths in
        /// flags and keys stay in the unit of the file. `auto` takes the unit that the comments of
        /// the file name. Without one, a person's height fits the rooms, and else the unit is a
        /// metre.
        unit: FileUnit = FileUnit::Auto;
    }
}

/// Unit of length of an OBJ file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileUnit {
    /// The unit that the comments of the file name.
    Auto,
    /// Millimetre.
    Millimetre,
    /// Centimetre.
    Centimetre,
    /// Metre.
    Metre,
    /// Inch.
    Inch,
    /// Foot.
    Foot,
}

named! {
    FileUnit: "auto" => Self::Auto, "mm" => Self::Millimetre, "cm" => Self::Centimetre, "m" => Self::Metre,
        "in" => Self::Inch, "ft" => Self::Foot;
}

impl FileUnit {
    /// Length of the unit in metres; `None` for `auto`.
    pub fn metres(self) -> Option<f32> {
        match self {
            Self::Auto => None,
            Self::Millimetre => Some(0.001),
            Self::Centimetre => Some(0.01),
            Self::Metre => Some(1.0),
            Self::Inch => Some(0.0254),
            Self::Foot => Some(0.3048),
        }
    }
}

/// Reader of OBJ and MTL files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ObjReader {
    /// The reader of this crate.
    Own,
    /// The tobj crate, with the feature `tobj`. Values, faces and materials are as tobj reads them.
    Tobj,
}

named! {
    ObjReader: "own" => Self::Own, "tobj" => Self::Tobj;
}

/// Displacements that are applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DisplacementUse {
    /// Applies displacements of the scene file, and displacements of a library if the object is
    /// subdivided.
    Auto,
    /// Applies all displacements.
    On,
    /// Applies no displacements.
    Off,
}

named! {
    DisplacementUse: "auto" => Self::Auto, "on" => Self::On, "off" => Self::Off;
}

/// Use of the colours of vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexColors {
    /// Used if no texture sets the colour, and if the vertices do not have a default grey.
    Auto,
    /// Colours of vertices are always used.
    On,
    /// Colours of vertices are never used.
    Off,
}

named! {
    VertexColors: "auto" => Self::Auto, "on" => Self::On, "off" => Self::Off;
}

/// Use of textures that are found by their file names, for materials without textures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapsByName {
    /// Textures are used if exactly one set of files fits the name.
    Auto,
    /// Textures are never found by their names.
    Off,
}

named! {
    MapsByName: "auto" => Self::Auto, "off" => Self::Off;
}

/// Use of caps, which close the cuts of sections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CutCaps {
    /// Cuts of closed surfaces have caps.
    On,
    /// Cuts stay open.
    Off,
}

named! {
    CutCaps: "on" => Self::On, "off" => Self::Off;
}

/// Encoding of the colours of vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexColorSpace {
    /// The transfer curve of sRGB.
    Srgb,
    /// Linear Rec.709.
    Linear,
}

named! {
    VertexColorSpace: "srgb" => Self::Srgb, "linear" => Self::Linear;
}

impl Named for CutLight {
    const NAMES: &'static [(&'static str, Self)] = Self::NAMES;
}

impl Named for Panes {
    const NAMES: &'static [(&'static str, Self)] = Self::NAMES;
}

impl Named for MtlDialect {
    const NAMES: &'static [(&'static str, Self)] = Self::NAMES;
}

/// Options for reading files.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Parts of OBJ files that are read.
    pub parts: PartFilter,
    /// Choices that the file formats leave open.
    pub parameters: LoadParameters,
    /// Maximum memory of the render and of reading its files, in bytes. `None`: the free memory of
    /// the system.
    pub max_memory: Option<u64>,
    /// True if a missing or unusable file, or a wrong statement, is an error even if a render is
    /// possible without it.
    pub strict: bool,
    /// True if materials may emit light although their library does not say so. Faces on the back
    /// of others are then listed for all materials.
    pub may_emit: bool,
}

impl LoadOptions {
    /// Options for reading material libraries.
    pub(crate) fn library_options(&self) -> LibraryOptions {
        LibraryOptions {
            dialect: self.parameters.mtl_dialect(),
            wrong_severity: self.severity_of_lack(),
        }
    }

    /// Returns true if files are read literally, without corrections of exporters' mistakes.
    pub fn is_literal(&self) -> bool {
        self.strict || self.parameters.mtl_dialect() == MtlDialect::Spec
    }

    /// Severity of a missing or unusable file, and of a wrong statement, if a render is possible
    /// without it.
    pub fn severity_of_lack(&self) -> Severity {
        if self.strict {
            Severity::Error
        } else {
            Severity::Warning
        }
    }
}

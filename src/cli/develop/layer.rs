//! Layers of an EXR file: channels grouped by the naming conventions of renderers.

use crate::film::{LINES, Rect};
use crate::io::{LayerChannel, Layers, Mattes, SampleKind};
use crate::options::nearest;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Maximum number of names in a message.
const MAX_NAMES: usize = 40;
/// Names that other renderers give to the layer of the picture, in lower case. Of a name with dots,
/// such as `ViewLayer.Combined`, the last word is compared.
const PICTURES: [&str; 6] = ["combined", "beauty", "rgba", "rgb", "image", "color"];

/// Kind of the numbers in a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LayerKind {
    /// Light, as red, green and blue or as luminance.
    Colors,
    /// Reflectances, which are shown without tone mapping.
    Reflectance,
    /// Distances.
    Depth,
    /// Directions.
    Normals,
    /// Points in space.
    Positions,
    /// Texture coordinates.
    Coordinates,
    /// Identifiers.
    Ids,
    /// Hashes of names with their coverage (Cryptomatte).
    Matte,
    /// Variances and other numbers of very different magnitudes.
    Magnitudes,
    /// Other numbers. A layer with several channels is shown as the length of its vectors.
    Numbers,
}

impl LayerKind {
    /// Returns true if values may be averaged.
    pub fn is_colors(self) -> bool {
        matches!(self, Self::Colors | Self::Reflectance)
    }

    fn name(self) -> &'static str {
        match self {
            Self::Colors => "light",
            Self::Reflectance => "reflectance",
            Self::Depth => "depth",
            Self::Normals => "directions",
            Self::Positions => "positions",
            Self::Coordinates => "texture coordinates",
            Self::Ids => "ids",
            Self::Matte => "Cryptomatte",
            Self::Magnitudes => "magnitudes",
            Self::Numbers => "numbers",
        }
    }
}

/// Channels of one layer.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    /// Name without components, such as `albedo` for `albedo.R`. Empty for `R G B` of the file.
    pub name: String,
    pub kind: LayerKind,
    /// True if the components are the colours of the file's picture.
    pub is_picture: bool,
    /// Components in order, with the indices of their channels.
    pub components: Vec<(String, usize)>,
}

impl Layer {
    /// Name of the layer in messages.
    pub fn title(&self) -> &str {
        match self.name.as_str() {
            "" => "RGB",
            name => name,
        }
    }

    /// Names of the channels in the developed picture, each with the index of the channel in the
    /// file that has its values. Colours always become `R G B`, even if the file has one grey
    /// channel.
    pub fn sources(&self) -> impl Iterator<Item = (String, usize)> + '_ {
        let is_grey = self.kind.is_colors() && self.components.len() <= 2 && !self.has("B");
        self.components.iter().flat_map(move |(component, index)| {
            let names: Vec<String> = match component.to_uppercase().as_str() {
                "A" if self.kind.is_colors() => vec!["A".into()],
                _ if is_grey => ["R", "G", "B"].map(String::from).into(),
                upper if self.kind.is_colors() => vec![upper.into()],
                _ if self.name.is_empty() || self.name == *component => vec![component.clone()],
                _ => vec![format!("{}.{component}", self.name)],
            };
            names.into_iter().map(move |name| (name, *index))
        })
    }

    /// Names of the channels in the developed picture.
    pub fn outputs(&self) -> impl Iterator<Item = String> + '_ {
        self.sources().map(|(name, _)| name)
    }

    /// Window of the layer's pixels in the full image.
    pub fn window(&self, layers: &Layers) -> Rect {
        let first = self
            .components
            .first()
            .and_then(|(_, index)| layers.channels.get(*index));
        first.map_or(Rect::full(layers.resolution), |channel| channel.window)
    }

    fn has(&self, component: &str) -> bool {
        self.components.iter().any(|(c, _)| c.eq_ignore_ascii_case(component))
    }

    /// Text of the layer for the list of layers.
    pub fn describe(&self, layers: &Layers) -> String {
        let components: Vec<&str> = self
            .components
            .iter()
            .map(|(component, _)| component.as_str())
            .collect();
        let samples = self.samples(layers).map_or("mixed samples", SampleKind::name);
        let window = self.window(layers);
        let part = if window == Rect::full(layers.resolution) {
            String::new()
        } else {
            format!(
                ", {}x{} pixels from {},{}",
                window.size().x,
                window.size().y,
                window.min.x,
                window.min.y
            )
        };
        let what = self.kind.name();
        let channels = match self.components.as_slice() {
            [(only, _)] if *only == self.name => String::new(),
            _ => format!(" ({})", components.join(" ")),
        };
        format!("{}{channels}: {what}, {samples}{part}", self.title())
    }

    /// The layer as JSON.
    pub fn json(&self, layers: &Layers) -> Value {
        let window = self.window(layers);
        let components: Vec<&str> = self
            .components
            .iter()
            .map(|(component, _)| component.as_str())
            .collect();
        let channels: Vec<&str> = self
            .components
            .iter()
            .map(|&(_, i)| layers.channels[i].name.as_str())
            .collect();
        json!({
            "name": self.title(),
            "kind": self.kind.name(),
            "components": components,
            "channels": channels,
            "samples": self.samples(layers).map(SampleKind::name),
            "window": [window.min.x, window.min.y, window.max.x, window.max.y],
            "names": self.names(layers),
            "numbers": self.numbers(layers).into_iter().collect::<BTreeMap<_, _>>(),
        })
    }

    /// Channels of the layer whose numbers have names, each with the names of the numbers 1, 2, …
    pub fn numbers<'a>(&self, layers: &'a Layers) -> Vec<(&'a str, Vec<&'a str>)> {
        let Some(names) = &layers.names else {
            return Vec::new();
        };
        let channels = (self.components.iter()).map(|&(_, i)| layers.channels[i].name.as_str());
        channels
            .filter_map(|channel| Some((channel, names.of_ids(channel)?)))
            .collect()
    }

    /// Names of the mattes of the layer; `None` if the layer has no mattes.
    fn names<'a>(&self, layers: &'a Layers) -> Option<Vec<&'a str>> {
        let is_of = |mattes: &&Mattes| self.kind == LayerKind::Matte && self.name.starts_with(&mattes.layer);
        let mattes = layers.mattes.iter().find(is_of)?;
        Some(mattes.names.iter().map(|(name, _)| name.as_str()).collect())
    }

    /// Number format of all components; `None` if they differ.
    fn samples(&self, layers: &Layers) -> Option<SampleKind> {
        let mut kinds = self.components.iter().map(|&(_, i)| layers.channels[i].kind);
        let first = kinds.next()?;
        kinds.all(|kind| kind == first).then_some(first)
    }
}

/// All layers in the order of their first channels; the picture comes first.
pub(super) fn all(layers: &Layers) -> Vec<Layer> {
    let mut found: Vec<Layer> = Vec::new();
    for (index, channel) in layers.channels.iter().enumerate() {
        let (name, component) = split(&channel.name);
        // Channels of one layer have equal windows.
        let same = |layer: &&mut Layer| layer.name == name && layer.window(layers) == channel.window;
        match found.iter_mut().find(same) {
            Some(layer) => layer.components.push((component.into(), index)),
            None => found.push(Layer {
                name: name.into(),
                kind: LayerKind::Numbers,
                is_picture: false,
                components: vec![(component.into(), index)],
            }),
        }
    }
    for layer in &mut found {
        layer
            .components
            .sort_by_key(|(component, index)| (rank(component), *index));
        layer.kind = kind(layer, layers);
    }
    let last_word = |layer: &Layer| layer.name.rsplit('.').next().unwrap_or_default().to_lowercase();
    let picture = found
        .iter()
        .position(|layer| layer.name.is_empty() && layer.kind == LayerKind::Colors)
        .or_else(|| {
            let mut named = found.iter();
            named.position(|layer| layer.kind == LayerKind::Colors && PICTURES.contains(&last_word(layer).as_str()))
        })
        .or_else(|| found.iter().position(|layer| layer.kind == LayerKind::Colors));
    if let Some(picture) = picture {
        found[picture].is_picture = true;
        let first = found.remove(picture);
        found.insert(0, first);
    }
    found
}

/// The layer or channel called `name`, or the picture if there is no `name`. An error has a message
/// and a help text.
pub(super) fn find(layers: &Layers, name: Option<&str>) -> Result<Layer, (String, String)> {
    let all = all(layers);
    let Some(name) = name else {
        let picture = all.iter().find(|layer| layer.is_picture).cloned();
        let message = "has no layer with colours".to_string();
        return picture.ok_or_else(|| (message, format!("choose a layer with --channel: {}", names(&all))));
    };
    if let Some(layer) = all.iter().find(|layer| layer.title() == name) {
        return Ok(layer.clone());
    }
    if let Some(index) = layers.channels.iter().position(|channel| channel.name == name) {
        return Ok(single(layers, index));
    }
    // Other renderers write the name of a view layer before the name of a layer. It is therefore
    // enough if the end of the name is equal.
    let ending = format!(".{}", name.to_lowercase());
    let mut ending = all.iter().filter(|layer| {
        let own = layer.title().to_lowercase();
        own == name.to_lowercase() || own.ends_with(&ending)
    });
    if let (Some(layer), None) = (ending.next(), ending.next()) {
        return Ok(layer.clone());
    }
    // Accept the names that other renderers use for layers of this program
    let own = match name.to_lowercase().as_str() {
        "depth" => Some("Z"),
        "normal" | "normals" => Some("N"),
        "position" => Some("P"),
        _ => None,
    };
    if let Some(layer) = all.iter().find(|layer| Some(layer.title()) == own) {
        return Ok(layer.clone());
    }
    let known = all
        .iter()
        .map(Layer::title)
        .chain(layers.channels.iter().map(|channel| channel.name.as_str()));
    let meant = nearest(name, known).map_or(String::new(), |known| format!("did you mean {known}? "));
    Err((
        format!("has no layer or channel {name}"),
        format!("{meant}the file has {}", names(&all)),
    ))
}

fn names(all: &[Layer]) -> String {
    let mut names: Vec<&str> = all.iter().map(Layer::title).take(MAX_NAMES).collect();
    if all.len() > MAX_NAMES {
        names.push("and more (--list)");
    }
    names.join(", ")
}

/// Layer of a single channel, shown as numbers and not as colours.
fn single(layers: &Layers, index: usize) -> Layer {
    let name = layers.channels[index].name.clone();
    let (layer, component) = split(&name);
    let whole = Layer {
        name: layer.into(),
        kind: LayerKind::Numbers,
        is_picture: false,
        components: vec![(component.into(), index)],
    };
    let kind = match kind(&whole, layers) {
        kind @ (LayerKind::Depth | LayerKind::Ids | LayerKind::Magnitudes) => kind,
        _ => LayerKind::Numbers,
    };
    Layer {
        components: vec![(name.clone(), index)],
        name,
        kind,
        ..whole
    }
}

/// Channels for metering and denoising that this program wrote, and the denoising data of Cycles.
/// Returns the name of each channel in this program, and the index of the channel in the file.
pub(super) fn guides(layers: &Layers) -> Vec<(&'static str, usize)> {
    const OWN: [&str; 23] = [
        "raw.R",
        "raw.G",
        "raw.B",
        "raw.A",
        "albedo.R",
        "albedo.G",
        "albedo.B",
        "N.X",
        "N.Y",
        "N.Z",
        "Z",
        "variance.R",
        "variance.G",
        "variance.B",
        "emitted",
        "samples",
        LINES,
        "coverage.R",
        "coverage.G",
        "coverage.B",
        "raw.coverage.R",
        "raw.coverage.G",
        "raw.coverage.B",
    ];
    const CYCLES: [(&str, &str); 6] = [
        ("albedo.R", "Denoising Albedo.R"),
        ("albedo.G", "Denoising Albedo.G"),
        ("albedo.B", "Denoising Albedo.B"),
        ("N.X", "Denoising Normal.X"),
        ("N.Y", "Denoising Normal.Y"),
        ("N.Z", "Denoising Normal.Z"),
    ];
    let index = |is: &dyn Fn(&LayerChannel) -> bool| layers.channels.iter().position(is);
    let own = OWN
        .into_iter()
        .filter_map(|name| Some((name, index(&|channel| channel.name == name)?)));
    let cycles = CYCLES
        .into_iter()
        .filter_map(|(name, theirs)| Some((name, index(&|channel| channel.name.ends_with(theirs))?)));
    own.chain(cycles).collect()
}

/// Splits the name of a channel into layer and component. A name without a dot is both the layer
/// and the component. Only `R`, `G`, `B`, `A` and `Y` are components of the layer with the empty
/// name.
fn split(channel: &str) -> (&str, &str) {
    match channel.rsplit_once('.') {
        Some(split) => split,
        None if ["R", "G", "B", "A", "Y"].contains(&channel) => ("", channel),
        None => (channel, channel),
    }
}

/// Sort key of a component: the position of the component in its layer.
fn rank(component: &str) -> usize {
    const ORDER: [&str; 9] = ["R", "G", "B", "X", "Y", "Z", "U", "V", "A"];
    let upper = component.to_uppercase();
    ORDER.iter().position(|known| *known == upper).unwrap_or(ORDER.len())
}

/// Kind of the numbers in a layer, according to its names and its number format.
fn kind(layer: &Layer, layers: &Layers) -> LayerKind {
    let name = layer.name.to_lowercase();
    let last = name.rsplit('.').next().unwrap_or_default();
    let mut components: Vec<String> = layer
        .components
        .iter()
        .map(|(component, _)| component.to_lowercase())
        .collect();
    components.sort();
    let has = |wanted: &[&str]| wanted.iter().all(|w| components.iter().any(|c| c == w));
    let is_whole = layer
        .components
        .iter()
        .all(|&(_, i)| layers.channels[i].kind == SampleKind::Whole);
    let is_one_of = |words: &[&str]| words.contains(&last);
    let single = components.len() == 1;
    if last.starts_with("crypto") {
        return LayerKind::Matte;
    }
    if is_whole
        || is_one_of(&[
            "id",
            "ids",
            "indexob",
            "indexma",
            "object_id",
            "material_id",
            "primid",
            "instid",
        ])
    {
        return LayerKind::Ids;
    }
    if name == LINES {
        return LayerKind::Reflectance;
    }
    if last.contains("variance") {
        return LayerKind::Magnitudes;
    }
    if single
        && (is_one_of(&["z", "depth", "mist", "zback"])
            || last.ends_with("depth")
            || (components[0] == "z" && last != "n"))
    {
        return LayerKind::Depth;
    }
    if has(&["x", "y", "z"]) {
        return match last {
            "n" | "ng" | "ns" => LayerKind::Normals,
            _ if last.contains("normal") => LayerKind::Normals,
            "p" | "position" | "pref" => LayerKind::Positions,
            _ => LayerKind::Numbers,
        };
    }
    if has(&["u", "v"]) || (is_one_of(&["uv"]) && components.len() >= 2) {
        return LayerKind::Coordinates;
    }
    if has(&["r", "g", "b"]) || (components.iter().any(|c| c == "y") && components.iter().all(|c| c == "y" || c == "a"))
    {
        return if last.contains("albedo") || is_one_of(&["diffcol", "glosscol", "transcol"]) {
            LayerKind::Reflectance
        } else {
            LayerKind::Colors
        };
    }
    LayerKind::Numbers
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::UVec2;

    fn layers(names: &[&str]) -> Layers {
        let resolution = UVec2::new(2, 1);
        let channel = |name: &&str| LayerChannel {
            name: name.to_string(),
            kind: SampleKind::Float,
            window: Rect::full(resolution),
            values: vec![0.0; 2],
        };
        Layers {
            resolution,
            view: resolution,
            channels: names.iter().map(channel).collect(),
            finish: crate::options::Finish::default(),
            backing: None,
            camera: None,
            mattes: Vec::new(),
            names: None,
        }
    }

    #[test]
    fn layers_are_known_by_their_names() {
        let file = layers(&[
            "A",
            "B",
            "G",
            "R",
            "N.X",
            "N.Y",
            "N.Z",
            "Z",
            "albedo.B",
            "albedo.G",
            "albedo.R",
            "id.object",
            "samples",
            "uv.U",
            "uv.V",
            "variance.B",
            "variance.G",
            "variance.R",
            "motion.X",
            "motion.Y",
            "CryptoObject00.R",
        ]);
        let found: Vec<(String, LayerKind)> = all(&file).iter().map(|l| (l.title().to_string(), l.kind)).collect();
        let found: Vec<(&str, LayerKind)> = found.iter().map(|(name, kind)| (name.as_str(), *kind)).collect();
        assert_eq!(
            found,
            [
                ("RGB", LayerKind::Colors),
                ("N", LayerKind::Normals),
                ("Z", LayerKind::Depth),
                ("albedo", LayerKind::Reflectance),
                ("id", LayerKind::Ids),
                ("samples", LayerKind::Numbers),
                ("uv", LayerKind::Coordinates),
                ("variance", LayerKind::Magnitudes),
                ("motion", LayerKind::Numbers),
                ("CryptoObject00", LayerKind::Matte),
            ]
        );
        let picture = find(&file, None).unwrap();
        assert_eq!(picture.outputs().collect::<Vec<_>>(), ["R", "G", "B", "A"]);
        assert_eq!(
            find(&file, Some("N")).unwrap().outputs().collect::<Vec<_>>(),
            ["N.X", "N.Y", "N.Z"]
        );
        assert_eq!(find(&file, Some("id.object")).unwrap().kind, LayerKind::Ids);
        let (message, help) = find(&file, Some("albedos")).unwrap_err();
        assert!(
            message.contains("albedos") && help.starts_with("did you mean albedo? the file has RGB, N, Z"),
            "{help}"
        );
    }

    #[test]
    fn other_renderers_are_understood() {
        let cycles = layers(&[
            "ViewLayer.Combined.A",
            "ViewLayer.Combined.B",
            "ViewLayer.Combined.G",
            "ViewLayer.Combined.R",
            "ViewLayer.Depth.Z",
            "ViewLayer.DiffCol.B",
            "ViewLayer.DiffCol.G",
            "ViewLayer.DiffCol.R",
            "ViewLayer.Normal.X",
            "ViewLayer.Normal.Y",
            "ViewLayer.Normal.Z",
        ]);
        let picture = find(&cycles, None).unwrap();
        assert_eq!(
            (picture.name.as_str(), picture.kind),
            ("ViewLayer.Combined", LayerKind::Colors)
        );
        assert_eq!(find(&cycles, Some("depth")).unwrap().kind, LayerKind::Depth);
        assert_eq!(find(&cycles, Some("Normal")).unwrap().kind, LayerKind::Normals);
        let grey = layers(&["Y"]);
        assert_eq!(
            find(&grey, None).unwrap().outputs().collect::<Vec<_>>(),
            ["R", "G", "B"]
        );
        let none = layers(&["Z"]);
        assert!(find(&none, None).unwrap_err().1.ends_with(": Z"));
    }
}

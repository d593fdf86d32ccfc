//! Masks from the mattes of an EXR file (Cryptomatte specification 1.2).

use super::{LayerChannel, Layers, Mattes};
use crate::film::Rect;
use crate::math::Glob;
use std::collections::HashSet;

/// Coverage of pixels by the names that match a pattern.
#[derive(Clone, Debug, PartialEq)]
pub struct MatteMask {
    /// Name of the layer.
    pub layer: String,
    /// Names of the layer that match the pattern.
    pub names: Vec<String>,
    /// Pixels of the full image that the mask covers.
    pub window: Rect,
    /// Fraction of each pixel of `window` that the names cover, row by row from the top.
    pub values: Vec<f32>,
}

impl MatteMask {
    /// Returns true if no pixel shows the names.
    pub fn is_empty(&self) -> bool {
        self.values.iter().all(|&share| share <= 0.0)
    }
}

impl Layers {
    /// Mask of all names that match `pattern`: `GLOB`, or `LAYER:GLOB` for the names of one layer.
    /// Without `LAYER`, the first layer with a match is used: parts, then objects, then other
    /// layers. `None` if no name matches.
    pub fn mask(&self, pattern: &str) -> Option<MatteMask> {
        let of_layer = pattern.split_once(':').and_then(|(layer, glob)| {
            let mattes = self.mattes.iter().find(|mattes| mattes.layer == layer)?;
            Some((vec![mattes], glob))
        });
        let (mut layers, glob) = of_layer.unwrap_or_else(|| (self.mattes.iter().collect(), pattern));
        let order = |mattes: &&Mattes| match mattes.layer.as_str() {
            layer if layer.ends_with("CryptoPart") => 0,
            layer if layer.ends_with("CryptoObject") => 1,
            _ => 2,
        };
        layers.sort_by_key(order);
        let glob = Glob::new(glob);
        layers.into_iter().find_map(|mattes| {
            let matching = mattes.names.iter().filter(|(name, _)| glob.matches(name));
            let (names, ids): (Vec<String>, HashSet<u32>) =
                matching.map(|(name, id)| (name.clone(), id.to_bits())).unzip();
            (!names.is_empty()).then(|| self.covered(&mattes.layer, names, &ids))?
        })
    }

    /// Mask of one of the names of the layer `mattes`. `None` if the file does not have the
    /// channels of the layer.
    pub fn mask_of(&self, mattes: &Mattes, (name, id): &(String, f32)) -> Option<MatteMask> {
        self.covered(&mattes.layer, vec![name.clone()], &HashSet::from([id.to_bits()]))
    }

    /// Bits of the ids that at least one pixel of the layer `mattes` shows.
    pub fn visible_ids(&self, mattes: &Mattes) -> HashSet<u32> {
        let pairs = self.pairs(&mattes.layer).into_iter();
        let values = pairs.flat_map(|[of_ids, shares]| of_ids.values.iter().zip(&shares.values));
        let visible = values.filter(|(_, share)| **share > 0.0);
        visible.map(|(id, _)| id.to_bits()).collect()
    }

    /// Channels of the layer `layer`: pairs of ids and shares. Pairs with another data window than
    /// the first are left out.
    fn pairs(&self, layer: &str) -> Vec<[&LayerChannel; 2]> {
        let channel = |name: String| {
            self.channels
                .iter()
                .find(|channel| channel.name.eq_ignore_ascii_case(&name))
        };
        let pairs = (0..).map_while(|level| {
            let names = ["R", "G", "B", "A"].map(|component| format!("{layer}{level:02}.{component}"));
            let [r, g, b, a] = names.map(channel);
            Some([[r?, g?], [b?, a?]])
        });
        let mut pairs: Vec<[&LayerChannel; 2]> = pairs.flatten().collect();
        if let Some(window) = pairs.first().map(|[ids, _]| ids.window) {
            pairs.retain(|pair| pair.iter().all(|channel| channel.window == window));
        }
        pairs
    }

    /// Mask of the names `names` of a layer. `ids` are the bits of the ids of these names. `None`
    /// if the file does not have the channels of the layer.
    fn covered(&self, layer: &str, names: Vec<String>, ids: &HashSet<u32>) -> Option<MatteMask> {
        let pairs = self.pairs(layer);
        let window = pairs.first()?[0].window;
        let mut values = vec![0.0; window.area() as usize];
        for [of_ids, shares] in pairs {
            let pixels = of_ids.values.iter().zip(&shares.values);
            for (value, (id, share)) in values.iter_mut().zip(pixels) {
                if ids.contains(&id.to_bits()) {
                    *value += share;
                }
            }
        }
        Some(MatteMask {
            layer: layer.into(),
            names,
            window,
            values,
        })
    }
}

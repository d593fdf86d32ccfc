use super::flags::NameParser;
use crate::cli::error::CliError;
use crate::io::{Compression, ExrFormat};

/// Flags for the storage of pictures in EXR files.
#[derive(Clone, Debug, Default, clap::Args)]
pub(in crate::cli) struct ExrArgs {
    /// Compression of EXR files; zips compresses each row alone, piz uses wavelets [default: zip]
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Compression>::new())]
    pub compression: Option<Compression>,

    /// Layers of EXR files to store as half floats, such as picture,albedo or all [default: none]
    ///
    /// Layers: picture (R G B A), raw, albedo, N, P, uv, motion, error, lights. Others stay
    /// float32.
    #[arg(long, value_name = "LAYER,...", value_delimiter = ',')]
    pub half: Vec<String>,
}

impl ExrArgs {
    /// EXR format that these flags select.
    ///
    /// # Errors
    ///
    /// A flag names a layer that cannot be stored as half floats.
    pub fn format(&self) -> Result<ExrFormat, CliError> {
        let mut format = ExrFormat::default();
        format.compression = self.compression.unwrap_or(format.compression);
        for name in &self.half {
            let layers = ExrFormat::HALF_LAYERS;
            match layers.iter().find(|layer| *layer == name) {
                Some(layer) => format.half.push(layer),
                None if name == "all" => format.half.extend(layers),
                None => {
                    return Err(CliError::Usage(format!(
                        "--half {name}: no such layer, or a layer that cannot be stored as half floats\n  help: choose from {}, or use all",
                        layers.join(", ")
                    )));
                }
            }
        }
        Ok(format)
    }
}

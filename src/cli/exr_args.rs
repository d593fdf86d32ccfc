use super::flags::NameParser;
use crate::io::Compression;

/// How EXR files hold pictures.
#[derive(Debug, Default, clap::Args)]
pub(super) struct ExrArgs {
    /// Compression of EXR files: zip, zips (by rows), piz (wavelets), rle or none [default: zip]
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Compression>::new())]
    pub compression: Option<Compression>,

    /// Layers of EXR files to hold as half floats: picture (R G B A), raw, albedo, N, P, uv, motion, error, lights, or all of these; others stay
    /// float32 [default: none]
    #[arg(long, value_name = "LAYER,...", value_delimiter = ',')]
    pub half: Vec<String>,
}

//! A sentence about what each contender changes, and the paper of its method.

use crate::cli::args::MethodFlag;
use crate::options::{IntegratorKind, OptionGroup, Parameter};
use crate::session::Settings;

/// Description and paper of a contender.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Lesson {
    pub sentence: String,
    /// Paper of the method; `None` for a method without a paper.
    pub paper: Option<Paper>,
}

/// A publication.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Paper {
    /// Authors and year.
    pub authors: &'static str,
    pub title: &'static str,
    /// Digital object identifier.
    pub doi: &'static str,
}

macro_rules! papers {
    ($($name:ident: $authors:literal, $title:literal, $doi:literal;)+) => {
        $(const $name: Paper = Paper { authors: $authors, title: $title, doi: $doi };)+
    };
}

papers! {
    KAJIYA: "Kajiya 1986", "The rendering equation", "10.1145/15922.15902";
    COOK: "Cook, Porter and Carpenter 1984", "Distributed ray tracing", "10.1145/800031.808590";
    WHITTED: "Whitted 1980", "An improved illumination model for shaded display", "10.1145/358876.358882";
    ARVO: "Arvo and Kirk 1990", "Particle transport and image synthesis", "10.1145/97879.97886";
    SHIRLEY: "Shirley, Wang and Zimmerman 1996", "Monte Carlo techniques for direct lighting calculations", "10.1145/226150.226151";
    VEACH: "Veach and Guibas 1995", "Optimally combining sampling techniques for Monte Carlo rendering", "10.1145/218380.218498";
    BIDIRECTIONAL: "Veach and Guibas 1995", "Bidirectional estimators for light transport", "10.1007/978-3-642-87825-1_11";
    METROPOLIS: "Veach and Guibas 1997", "Metropolis light transport", "10.1145/258734.258775";
    KELEMEN: "Kelemen, Szirmay-Kalos, Antal and Csonka 2002", "A simple and robust mutation strategy for the Metropolis light transport algorithm", "10.1111/1467-8659.t01-1-00703";
    JENSEN: "Jensen 1996", "Global illumination using photon maps", "10.1007/978-3-7091-7484-5_3";
    HACHISUKA: "Hachisuka and Jensen 2009", "Stochastic progressive photon mapping", "10.1145/1618452.1618487";
    GEORGIEV: "Georgiev, Křivánek, Davidovič and Slusallek 2012", "Light transport simulation with vertex connection and merging", "10.1145/2366145.2366211";
    WARD: "Ward, Rubinstein and Clear 1988", "A ray tracing solution for diffuse interreflection", "10.1145/54852.378490";
    BEKAERT: "Bekaert, Sbert and Halton 2002", "Accelerating path tracing by re-using paths", "10.2312/EGWR/EGWR02/125-134";
}

fn lesson(sentence: &str, paper: Paper) -> Lesson {
    Lesson {
        sentence: sentence.into(),
        paper: Some(paper),
    }
}

/// Names and lessons of the ladder, from the lowest rung up.
const RUNGS: [(&str, &str, Paper); 8] = [
    (
        "naive: emit or reflect",
        "A path finds lights only by chance. At each surface a coin decides between emission and reflection.",
        KAJIYA,
    ),
    (
        "uniform directions",
        "Emission and reflection both count at each surface, and directions are uniform over the hemisphere.",
        KAJIYA,
    ),
    (
        "+ cosine directions",
        "Importance sampling: directions are drawn in proportion to the cosine, which then adds no variance.",
        COOK,
    ),
    (
        "+ Russian roulette",
        "Russian roulette: paths that carry little light end by chance, and the survivors weigh more. A sample is noisier, but many more fit into the time.",
        ARVO,
    ),
    (
        "+ light sampling",
        "Next-event estimation: each surface sends a shadow ray to a random point on a light.",
        SHIRLEY,
    ),
    (
        "+ MIS",
        "Multiple importance sampling: the balance heuristic weighs light sampling against rays that hit a light.",
        VEACH,
    ),
    (
        "+ BSDF, power",
        "Directions are drawn from the BSDF, so glossy surfaces find the lights that they reflect. Weights follow the power heuristic.",
        VEACH,
    ),
    (
        "best: + shared paths",
        "Path reuse: each pixel connects to the second vertices of its neighbours' paths, and shares the light found from there.",
        BEKAERT,
    ),
];

/// Names and lessons of the ladder, from the lowest rung up.
pub(super) fn rungs() -> impl Iterator<Item = (&'static str, Lesson)> {
    RUNGS
        .into_iter()
        .map(|(name, sentence, paper)| (name, lesson(sentence, paper)))
}

/// The paper that introduced an integrator.
fn paper(kind: IntegratorKind) -> Option<Paper> {
    Some(match kind {
        IntegratorKind::Path | IntegratorKind::Naive | IntegratorKind::OneSample | IntegratorKind::Area => KAJIYA,
        IntegratorKind::Whitted => WHITTED,
        IntegratorKind::Distributed => COOK,
        IntegratorKind::Direct => SHIRLEY,
        IntegratorKind::Light | IntegratorKind::Bidirectional => BIDIRECTIONAL,
        IntegratorKind::PrimarySpace => KELEMEN,
        IntegratorKind::PathSpace => METROPOLIS,
        IntegratorKind::ProgressivePhotons => HACHISUKA,
        IntegratorKind::PhotonMap => JENSEN,
        IntegratorKind::VertexMerging => GEORGIEV,
        IntegratorKind::IrradianceCache => WARD,
        // `ao` and `debug` do not estimate light.
        _ => return None,
    })
}

/// Describes the integrator of `flag`, then each setting in `flag`, then the bias.
pub(super) fn of_method(flag: &MethodFlag, settings: &Settings) -> Lesson {
    let kind = flag.integrator.integrator();
    let mut sentence = String::from(kind.help());
    let groups = [
        flag.integrator.entries(),
        flag.sampling.entries(),
        flag.filter.entries(),
    ];
    for entry in groups.into_iter().flatten().filter(|entry| entry.key != "integrator") {
        let parameter = MethodFlag::parameters().find(|parameter| parameter.key == entry.key);
        let help = parameter.map(Parameter::help);
        sentence += &format!("; {} = {} ({})", entry.key, entry.text, help.unwrap_or_default());
    }
    if let Some(bias) = settings.chosen_integrator().bias() {
        sentence += &format!("; biased by {bias}");
    }
    Lesson {
        sentence: sentence + ".",
        paper: paper(kind),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Named;

    /// The course (`docs/guide/learn`) names the same papers with the same DOI.
    #[test]
    fn papers_are_those_of_the_course() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/guide/learn");
        let pages = std::fs::read_dir(folder).unwrap().map(|page| page.unwrap().path());
        let course: String = pages.map(|page| std::fs::read_to_string(page).unwrap()).collect();
        let of_methods = IntegratorKind::NAMES.iter().filter_map(|(_, kind)| paper(*kind));
        for Paper { authors, title, doi } in rungs().filter_map(|(_, lesson)| lesson.paper).chain(of_methods) {
            let entry = format!("{authors}, *{title}*, [{doi}](https://doi.org/{doi})");
            assert!(course.contains(&entry), "{entry}");
        }
        let is_without = |(_, kind): &&(&str, IntegratorKind)| paper(*kind).is_none();
        let without: Vec<&str> = IntegratorKind::NAMES
            .iter()
            .filter(is_without)
            .map(|(name, _)| *name)
            .collect();
        assert_eq!(without, ["ao", "debug"]);
    }
}

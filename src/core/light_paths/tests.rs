use super::syntax::{CAMERA, Node, Symbols, parse};
use super::*;
use crate::math::hash::mix;
use std::collections::BTreeSet;

/// Generator of pseudorandom numbers.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, n: usize) -> usize {
        self.0 = mix(self.0.wrapping_add(0x9e37_79b9_7f4a_7c15));
        (self.0 % n as u64) as usize
    }
}

/// End positions of all matches of `node` in `word` that begin at `start`. They are computed
/// directly from the definition of each kind of node.
fn ends(node: &Node, word: &[Symbols], start: usize) -> BTreeSet<usize> {
    match node {
        Node::Symbol(symbols) => {
            let is_match = word.get(start).is_some_and(|symbol| symbol & symbols != 0);
            is_match.then_some(start + 1).into_iter().collect()
        }
        Node::Sequence(nodes) => nodes.iter().fold(BTreeSet::from([start]), |from, node| {
            from.iter().flat_map(|&start| ends(node, word, start)).collect()
        }),
        Node::Either(nodes) => nodes.iter().flat_map(|node| ends(node, word, start)).collect(),
        Node::Repeated { node, min, max } => {
            let mut found = BTreeSet::new();
            let mut from = BTreeSet::from([start]);
            let max = max.map_or(*min as usize + word.len() + 1, |max| max as usize);
            for count in 0..=max {
                if count >= *min as usize {
                    found.extend(&from);
                }
                from = from.iter().flat_map(|&start| ends(node, word, start)).collect();
            }
            found
        }
    }
}

const KINDS: [EventKind; 6] = [
    EventKind::DiffuseReflection,
    EventKind::GlossyReflection,
    EventKind::SpecularReflection,
    EventKind::DiffuseTransmission,
    EventKind::GlossyTransmission,
    EventKind::SpecularTransmission,
];
const LIGHTS: [PathLight; 3] = [PathLight::Background, PathLight::Surface, PathLight::Point];

/// All sequences of 0 to `max` events, in the order from the camera to the light.
fn sequences(max: usize) -> Vec<Vec<EventKind>> {
    let mut all = vec![Vec::new()];
    let mut start = 0;
    for _ in 0..max {
        let end = all.len();
        for i in start..end {
            for kind in KINDS {
                all.push([all[i].clone(), vec![kind]].concat());
            }
        }
        start = end;
    }
    all
}

/// The path as symbols, from the camera to the light.
fn word(events: &[EventKind], light: PathLight) -> Vec<Symbols> {
    let events = events.iter().map(|kind| 1 << (*kind as usize));
    [CAMERA]
        .into_iter()
        .chain(events)
        .chain([1 << (6 + light as usize)])
        .collect()
}

fn class_of(paths: &LightPaths, events: &[EventKind], light: PathLight) -> usize {
    let start = LightPaths::class_of(light);
    events
        .iter()
        .rev()
        .fold(start, |class, kind| paths.scattered(class, *kind))
}

fn own(expression: &str) -> Result<Vec<PathPart>, LightPathError> {
    PathPart::parse(&format!("lpe:x={expression}"))
}

fn named(names: &[&str]) -> Vec<PathPart> {
    let mut parts = Vec::new();
    for name in names {
        PathPart::add(&mut parts, PathPart::parse(name).unwrap()).unwrap();
    }
    parts
}

/// Checks the automaton of `expressions` for all paths with 0 to 4 events: it must accept the same
/// paths as [`ends`], the direct evaluation of the expressions.
fn check(expressions: &[String]) {
    let parts: Vec<PathPart> = expressions.iter().flat_map(|e| own(e).unwrap()).collect();
    let paths = LightPaths::new(&parts).unwrap();
    let nodes: Vec<Node> = expressions.iter().map(|e| parse(e).unwrap()).collect();
    for events in sequences(4) {
        for light in LIGHTS {
            let from_camera = word(&events, light);
            let from_light: Vec<Symbols> = from_camera.iter().rev().copied().collect();
            let class = class_of(&paths, &events, light);
            for (part, node) in nodes.iter().enumerate() {
                let matches = [&from_camera, &from_light]
                    .iter()
                    .any(|w| ends(node, w, 0).contains(&w.len()));
                assert_eq!(
                    paths.is_in(class, part),
                    matches,
                    "{}, {from_camera:?}",
                    expressions[part]
                );
            }
        }
    }
}

#[test]
fn automata_match_definition_of_expressions() {
    let expressions = [
        "LS+DE",
        "L(D|S)*E",
        "C.*L",
        "CL",
        "CD+L",
        "C<RD>L",
        "C<TS>+<RD>.*[LO]",
        "CS*D[GS]+O",
        "C[^S]{2,3}B",
        "C(D(G|S)?){1,2}L",
        "OD{2}E",
        "(CDL|CG.L)",
        "L(DS*)*E",
        "C<.D><.[GS]>?L",
        "C[<RD><TS>]+L",
        "C R T? L",
        "C((S*)*D?)*L",
    ];
    for chunk in expressions.chunks(4) {
        check(&chunk.iter().map(|e| e.to_string()).collect::<Vec<_>>());
    }
}

/// Checks random expressions between the camera and a light.
#[test]
fn random_automata_match_definition_of_expressions() {
    fn random(dice: &mut Dice, depth: usize) -> String {
        const SYMBOLS: [&str; 8] = ["D", "G", "S", ".", "<RD>", "<T.>", "[^S]", "[DS]"];
        match dice.roll(if depth == 0 { 2 } else { 6 }) {
            0 | 1 => SYMBOLS[dice.roll(SYMBOLS.len())].into(),
            2 => random(dice, depth - 1) + &random(dice, depth - 1),
            3 => format!("({}|{})", random(dice, depth - 1), random(dice, depth - 1)),
            4 => format!("({})", random(dice, depth - 1)),
            _ => {
                const COUNTS: [&str; 6] = ["*", "+", "?", "{2}", "{1,2}", "{2,}"];
                format!("({}){}", random(dice, depth - 1), COUNTS[dice.roll(COUNTS.len())])
            }
        }
    }
    let mut dice = Dice(7);
    for i in 0..40 {
        let inner = random(&mut dice, 3);
        let light = ["L", "O", "B", "[OB]"][dice.roll(4)];
        check(&[if i % 2 == 0 {
            format!("C{inner}{light}")
        } else {
            format!("{light}{inner}E")
        }]);
    }
}

#[test]
fn invalid_expression_is_an_error_with_its_position() {
    for (expression, words) in [
        ("", "ends too early"),
        ("C", "lead from the camera to a light"),
        ("DSL", "lead from the camera to a light"),
        ("C.*", "lead from the camera to a light"),
        ("L*", "lead from the camera to a light"),
        ("CDC", "lead from the camera to a light"),
        ("CDLDL", "stands between"),
        ("C(DL)+", "stands between"),
        ("CXL", "`X` at character 2"),
        ("C<RX>L", "`X` at character 4"),
        ("C<RT>L", "`T` at character 4"),
        ("C<RDL", "`L` at character 5"),
        ("C[D", "ends too early, after character 3"),
        ("C[DL]", "`L` at character 4"),
        ("C[]L", "`]` at character 3"),
        ("C[^DGS]L", "remove a symbol"),
        ("C(DL", "ends too early"),
        ("CD)L", "`)` at character 3"),
        ("C|*L", "`*` at character 3"),
        ("C()L", "`)` at character 3"),
        ("CD{3,1}L", "`}` at character 7"),
        ("CD{0}L", "`}` at character 5"),
        ("CD{101}L", "the maximum count is 100"),
        ("CD{,3}L", "`,` at character 4"),
        ("C(.{50}){50}L", "longer than 128 events"),
        ("CV L", "`V` at character 2"),
        ("CD\nΩL", "`\\u{3a9}` at character 4"),
    ] {
        let error = own(expression).expect_err(expression).to_string();
        assert!(
            error.contains(words) && error.contains("help:"),
            "{expression}: {error}"
        );
    }
    let long = format!("C{}L", "D".repeat(300));
    assert!(own(&long).unwrap_err().message.contains("302 characters"));
    let nested = format!("C{}D{}L", "(".repeat(90), ")".repeat(90));
    assert!(own(&nested).is_ok());
}

/// Parsing a random text never panics: the result is an expression or an error.
#[test]
fn random_text_is_an_expression_or_an_error() {
    const LETTERS: [char; 26] = [
        'C', 'E', 'L', 'O', 'B', 'D', 'G', 'S', 'R', 'T', '.', '(', ')', '[', ']', '<', '>', '^', '*', '+', '?', '{',
        '}', ',', '3', '|',
    ];
    let mut dice = Dice(3);
    let mut read = 0;
    for i in 0..200_000 {
        let mut text: String = (0..dice.roll(12)).map(|_| LETTERS[dice.roll(LETTERS.len())]).collect();
        if i % 2 == 0 {
            text = format!("C{text}L");
        }
        if i % 100 == 1 {
            text.push('é');
        }
        if let Ok(parts) = own(&text) {
            read += usize::from(LightPaths::new(&parts).is_ok());
        }
    }
    assert!(read > 2000, "{read}");
}

#[test]
fn names_are_checked() {
    for (name, words) in [
        ("lpe:", "needs a name"),
        ("lpe:CL", "needs a name"),
        ("lpe:=CL", "is not a layer name"),
        ("lpe:a b=CL", "is not a layer name"),
        ("lpe:a.b=CL", "is not a layer name"),
        ("lpe:12345678901234567890abcd=CL", "is not a layer name"),
        ("bounces:", "is not a number of bounces"),
        ("bounces:21", "is not a number of bounces"),
        ("bounces:x", "is not a number of bounces"),
        ("bounce.-1", "is not a number of bounces"),
        ("bounce.rest", "needs the bounces before it"),
        ("glossy", "no such part"),
    ] {
        let error = PathPart::parse(name).expect_err(name).to_string();
        assert!(error.contains(words) && error.contains("help:"), "{name}: {error}");
    }
    let mut parts = named(&["direct", "direct", "bounce.2", "bounces:3", "lpe:a=CDL"]);
    let layers: Vec<&str> = parts.iter().map(PathPart::layer).collect();
    let expected = [
        "direct",
        "bounce.2",
        "bounce.0",
        "bounce.1",
        "bounce.3",
        "bounce.rest",
        "lpe_a",
    ];
    assert_eq!(layers, expected);
    for twice in ["bounces:4", "lpe:a=CGL"] {
        assert!(
            PathPart::add(&mut parts, PathPart::parse(twice).unwrap()).is_err(),
            "{twice}"
        );
    }
    let words: Vec<String> = parts.iter().map(PathPart::describe).collect();
    assert_eq!(&words[5..], ["bounce.rest=C.{4,}L", "lpe:a=CDL"]);
    let many: Vec<PathPart> = (0..41)
        .flat_map(|i| PathPart::parse(&format!("lpe:e{i}=CDL")).unwrap())
        .collect();
    assert!(LightPaths::new(&many[..40]).is_ok() && LightPaths::new(&many).is_err());
    // The automaton of this expression needs many classes: it must distinguish which of the last
    // seven events were diffuse.
    let deep = PathPart::parse("lpe:a=C.{7}D.*L").unwrap();
    assert!(
        LightPaths::new(&deep)
            .unwrap_err()
            .message
            .contains("more than 64 classes")
    );
}

/// All named parts together need at most 25 classes. The image is divided in three ways: each class
/// is in exactly one part of each division.
#[test]
fn named_parts_divide_all_paths() {
    let names: Vec<&str> = PathPart::names()
        .filter(|name| PathPart::parse(name).is_ok() && !name.contains('.'))
        .collect();
    assert_eq!(names.len(), 10);
    let parts = named(&names);
    let paths = LightPaths::new(&parts).unwrap();
    println!("{} classes", paths.classes());
    assert!(paths.classes() <= 25);
    let in_layers = |class: usize, is: &dyn Fn(&str) -> bool| {
        let layers = paths.layers().iter().enumerate();
        layers
            .filter(|(part, layer)| is(layer) && paths.is_in(class, *part))
            .count()
    };
    for class in 0..paths.classes() {
        let whole: [&dyn Fn(&str) -> bool; 3] = [
            &|layer| layer.starts_with("bounce"),
            &|layer| ["emission", "direct", "indirect"].contains(&layer),
            &|layer| layer == "emission" || layer.contains('_'),
        ];
        assert_eq!(whole.map(|is| in_layers(class, is)), [1, 1, 1], "{class}");
    }
    let is_in = |events: &[EventKind], layer: &str| {
        let part = paths.layers().iter().position(|l| l == layer).unwrap();
        paths.is_in(class_of(&paths, events, PathLight::Surface), part)
    };
    assert!(is_in(&[KINDS[0]], "diffuse_direct") && is_in(&[KINDS[5], KINDS[5]], "transmission_indirect"));
    assert!(is_in(&[KINDS[2]; 3], "bounce.3") && is_in(&[KINDS[2]; 6], "bounce.rest"));
}

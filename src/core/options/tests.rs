use super::*;

#[test]
fn values_are_read_and_checked() {
    let mut options = IntegratorOptions::default();
    assert_eq!(options.set("cache_rays", Input::Flag("64")), Some(Ok(())));
    assert_eq!(options.set("photon_radius", Input::Number("0.5")), Some(Ok(())));
    assert_eq!(options.set("integrator", Input::String("vcm")), Some(Ok(())));
    assert_eq!(options.set("max_depth", Input::String("none")), Some(Ok(())));
    assert_eq!((options.cache_rays, options.photon_radius), (Some(64), Some(0.5)));
    assert_eq!(options.max_depth(), MaxDepth(None));
    assert_eq!(
        options.given(),
        ["integrator", "max_depth", "photon_radius", "cache_rays"]
    );
    assert_eq!(options.set("cache_rats", Input::Flag("64")), None);
}

#[test]
fn invalid_values_are_errors_with_help() {
    for (key, input, value, help) in [
        (
            "cache_rays",
            Input::Flag("15"),
            "15",
            "use a whole number from 16 to 1048576",
        ),
        (
            "cache_rays",
            Input::Number("1.5"),
            "1.5",
            "use a whole number from 16 to 1048576",
        ),
        (
            "cache_rays",
            Input::String("64"),
            "\"64\"",
            "use a whole number from 16 to 1048576",
        ),
        (
            "cache_error",
            Input::Number("NaN"),
            "NaN",
            "use a number above 0, at most 1",
        ),
        ("photon_radius", Input::Flag("inf"), "inf", "use a number above 0"),
        (
            "branching",
            Input::Other("true"),
            "true",
            "use a whole number 1 or more",
        ),
        (
            "max_depth",
            Input::Flag("1025"),
            "1025",
            "use a whole number up to 1024, or none",
        ),
        (
            "max_depth",
            Input::String("3"),
            "\"3\"",
            "use a whole number up to 1024, or none",
        ),
        (
            "debug_view",
            Input::String("normal"),
            "\"normal\"",
            "did you mean normals? choose among normals, uv, barycentrics, ids, material, albedo, depth, wireframe, facing, light-count, ray-cost",
        ),
        ("reuse", Input::Flag("x"), "x", "choose among pixels, none"),
    ] {
        let mut options = IntegratorOptions::default();
        let invalid = options.set(key, input).unwrap().unwrap_err();
        assert_eq!((invalid.value.as_str(), invalid.help.as_str()), (value, help), "{key}");
        assert_eq!(options, IntegratorOptions::default());
    }
}

/// Values that a program sets are checked like parsed values.
#[test]
fn values_set_by_code_are_checked() {
    let wrong = [
        IntegratorOptions {
            cache_rays: Some(15),
            ..Default::default()
        },
        IntegratorOptions {
            photon_radius: Some(f32::NAN),
            ..Default::default()
        },
        IntegratorOptions {
            max_depth: Some(MaxDepth(Some(5000))),
            ..Default::default()
        },
    ];
    let keys: Vec<_> = wrong.iter().map(|options| options.invalid().unwrap().key).collect();
    assert_eq!(keys, ["cache_rays", "photon_radius", "max_depth"]);
    assert_eq!(IntegratorOptions::default().invalid(), None);
}

/// The description of an integrator contains a parameter if and only if the integrator reads the
/// parameter. The defaults of an integrator may depend on the values of other parameters.
#[test]
fn methods_describe_the_parameters_they_read() {
    for &(name, kind) in IntegratorKind::NAMES {
        let usual = IntegratorOptions {
            integrator: Some(kind),
            ..Default::default()
        };
        let usual_text = ChosenIntegrator::new(&usual).describe();
        assert!(usual_text.starts_with(&format!("integrator={name}")));
        for parameter in IntegratorOptions::PARAMETERS.iter().filter(|p| p.key != "integrator") {
            // Choose a value that differs from the default
            let others = ["7", "77", "0.125", "0.375", "constant:0.5"]
                .into_iter()
                .chain(parameter.names().into_iter().rev());
            let other = others.filter_map(|text| {
                let mut options = usual;
                options.set(parameter.key, Input::Flag(text))?.ok()?;
                Some(ChosenIntegrator::new(&options).describe())
            });
            let is_told = other.into_iter().any(|text| text != usual_text);
            assert_eq!(
                is_told,
                kind.parameters().contains(&parameter.key),
                "{name}: {}",
                parameter.key
            );
        }
    }
    let alone = IntegratorOptions {
        reuse: Some(PathReuse::None),
        ..Default::default()
    };
    assert!(
        ChosenIntegrator::new(&alone)
            .describe()
            .ends_with("reuse=none light_samples=1")
    );
    assert!(
        ChosenIntegrator::default()
            .describe()
            .ends_with("reuse=pixels light_samples=3")
    );
}

/// Flags override scene files, and scene files override defaults.
#[test]
fn options_overlay_each_other() {
    let flags = IntegratorOptions {
        branching: Some(2),
        ..Default::default()
    };
    let file = IntegratorOptions {
        branching: Some(3),
        cache_rays: Some(64),
        ..Default::default()
    };
    let both = flags.or(file);
    assert_eq!((both.branching(), both.cache_rays(), both.gather_rays()), (2, 64, 4));
}

#[test]
fn near_names_are_suggested() {
    assert_eq!(nearest("widht", ["width", "height"]), Some("width"));
    assert_eq!(nearest("zzz", ["width", "height"]), None);
}

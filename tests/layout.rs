//! Records and names that Rust and the shaders share, checked without a GPU: naga reads the shaders as wgpu does.

use light_cache::Scheme;
use render::gpu::{
    AovPixel, CleanParams, Count, FilmPixel, FrameParams, GuidePixel, KnownPixel, LessonCounters, LessonParams,
    PackedObservation, PixelControl, Run, Seen, TintPixel, files, link,
};
use scene::packed::{PackedLight, SceneParams};
use std::mem::offset_of;
use std::path::Path;
use wgpu::naga::{Module, TypeInner};

/// Every pass with every sampler is one module, with auxiliary images or without.
fn module(pass: &str, scheme: Scheme, aovs: bool) -> Module {
    let text = link(&format!("#import \"pass/{pass}.wgsl\"\n"), scheme, aovs).expect("every import has a file");
    wgpu::naga::front::wgsl::parse_str(&text).unwrap_or_else(|error| panic!("{}", error.emit_to_string(&text)))
}

/// Names and offsets of a struct's members, and its size.
fn layout(module: &Module, name: &str) -> (Vec<(String, usize)>, usize) {
    let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
    let Some((_, ty)) = found else {
        panic!("no struct {name}")
    };
    let TypeInner::Struct { members, span } = &ty.inner else {
        panic!("{name} is no struct")
    };
    let named = members
        .iter()
        .map(|m| (m.name.clone().expect("members have names"), m.offset as usize));
    (named.collect(), *span as usize)
}

/// Asserts that a Rust record has the same members at the same places.
macro_rules! same_layout {
    ($module:expr, $shader:literal, $rust:ty: $($field:ident),* $(,)?) => {
        let expected = vec![$((stringify!($field).to_owned(), offset_of!($rust, $field))),*];
        assert_eq!(layout($module, $shader), (expected, size_of::<$rust>()), $shader);
    };
}

#[test]
fn records_lie_alike_in_memory() {
    let module = &module("path", Scheme::Uniform, true);
    same_layout!(module, "FrameParams", FrameParams: origin_ws, width, corner_ws, height, step_x_ws, frame, step_y_ws, weight,
        seed, max_bounces, light_samples, clear, candidates, slots, controls);
    same_layout!(module, "FilmPixel", FilmPixel: hi, lo, weight_hi, weight_lo, count, nonfinite, rays_nearest, rays_occluded,
        pad0, pad1, control);
    same_layout!(module, "AovPixel", AovPixel: hi, lo, depth_hi, depth_lo, hits, light);
    same_layout!(module, "PixelControl", PixelControl: share, count, mean_found, mean_control, found_sq, control_sq, mixed, scale);
    same_layout!(module, "Observation", PackedObservation: position_ws, light, normal_ws, flags, unshadowed, irradiance, pmf,
        bounce_radiance);
    same_layout!(module, "SceneParams", SceneParams: fixed_root, top_root, placed, triangles, instances, meshes, materials,
        textures, emitter_lights, albedo, srgb, light_count, radius, area_lights, pad0, pad1);
    same_layout!(module, "Light", PackedLight: position_ws, kind, edge1_ws, area, edge2_ws, range, normal_ws, cos_inner,
        intensity, cos_outer, primitive, pad);
    let module = &self::module("thin", Scheme::Uniform, false);
    same_layout!(module, "LessonParams", LessonParams: frame, stride, pad0, pad1);
    same_layout!(module, "LessonCounters", LessonCounters: observed, kept, runs, pad);
    same_layout!(module, "Run", Run: frame, tile, first, count, weight);
    let module = &self::module("split", Scheme::Uniform, false);
    same_layout!(module, "Seen", Seen: x_axis, half_width, y_axis, half_height, z_axis, width, translation, height);
    same_layout!(module, "CleanParams", CleanParams: now, before, spp, pixel_size, variance_scale, pad);
    same_layout!(module, "Guide", GuidePixel: normal, footprint, position, depth);
    same_layout!(module, "Tint", TintPixel: reflected, pad0, added, pad1);
    same_layout!(module, "Known", KnownPixel: irradiance, luminance_sq, samples, spread, pad0, pad1);
    let module = &self::module("count", Scheme::Uniform, false);
    same_layout!(module, "Count", Count: rays_nearest, rays_occluded, nonfinite);
}

#[test]
fn passes_are_valid_and_keep_to_the_default_limits() {
    use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};
    let schemes = [Scheme::Uniform, Scheme::Discrete, Scheme::Tree, Scheme::Adaptive];
    let paths = schemes.map(|scheme| [false, true].map(|aovs| ("path", scheme, aovs)));
    let others = [
        "tally", "thin", "split", "recall", "vary", "atrous", "assemble", "typical", "resolve", "mean", "count",
    ];
    let others = others.map(|pass| (pass, Scheme::Uniform, false));
    for (pass, scheme, aovs) in paths.into_iter().flatten().chain(others) {
        let module = module(pass, scheme, aovs);
        let valid = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
        assert!(valid.is_ok(), "{pass} {scheme:?}: {:?}", valid.err());
        let storage = module
            .global_variables
            .iter()
            .filter(|(_, variable)| matches!(variable.space, wgpu::naga::AddressSpace::Storage { .. }));
        // Auxiliary images are asked for by name, and refused where there is one buffer too few.
        let most = wgpu::Limits::default().max_storage_buffers_per_shader_stage as usize + usize::from(aovs);
        assert!(storage.count() <= most, "{pass} {scheme:?}");
    }
}

/// A comment that names a function which is gone misleads: the shader may have been left behind.
#[test]
fn every_twin_is_still_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut twins = 0;
    for (file, text) in files() {
        for line in text.lines().filter_map(|line| line.trim().strip_prefix("// twin: ")) {
            let (path, name) = line.split_once(' ').unwrap_or_else(|| panic!("{file}: '{line}'"));
            let source = std::fs::read_to_string(root.join(path)).unwrap_or_else(|_| panic!("{file}: no file {path}"));
            let defined = ["fn", "struct", "const", "enum"].iter().any(|keyword| {
                let start = format!("{keyword} {name}");
                source.match_indices(&start).any(|(at, _)| {
                    let next = source[at + start.len()..].chars().next();
                    !next.is_some_and(|c| c.is_alphanumeric() || c == '_')
                })
            });
            assert!(defined, "{file}: {path} has no {name} any more");
            twins += 1;
        }
    }
    assert!(twins > 50, "only {twins} twins were found");
}

/// The value of the constant `name` in Rust or WGSL, as it is written but for the types of its numbers.
fn constant(source: &str, name: &str) -> Option<String> {
    let start = format!("const {name}: ");
    let (_, value) = source[source.find(&start)? + start.len()..].split_once(" = ")?;
    let (value, _) = value.split_once(';')?;
    let words = value.replace('_', "");
    let bare = |word: &str| match word.strip_suffix('u') {
        Some(number) if number.starts_with(|c: char| c.is_ascii_digit()) => number.to_owned(),
        _ => word.to_owned(),
    };
    Some(words.split(' ').map(bare).collect::<Vec<_>>().join(" "))
}

#[test]
fn constants_have_the_same_values() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut compared = 0;
    for (file, text) in files() {
        for (at, _) in text.match_indices("// twin: ") {
            let lines = &text[at..];
            let twin = lines
                .lines()
                .next()
                .and_then(|line| line["// twin: ".len()..].split_once(' '));
            let (path, name) = twin.unwrap_or_else(|| panic!("{file}: a twin without a name"));
            let Some(definition) = lines.lines().find(|line| !line.starts_with("//")) else {
                continue;
            };
            // Integers of 64 bits are spelled as two halves.
            let shader_name = definition.strip_prefix("const ").and_then(|rest| rest.split_once(": "));
            let Some((shader_name, _)) = shader_name.filter(|(_, rest)| !rest.starts_with("vec2<u32>")) else {
                continue;
            };
            let source = std::fs::read_to_string(root.join(path)).unwrap_or_else(|_| panic!("{file}: no file {path}"));
            let [shader, rust] = [constant(definition, shader_name), constant(&source, name)];
            assert!(
                shader.is_some() && shader == rust,
                "{file} {name}: {shader:?}, {path}: {rust:?}"
            );
            compared += 1;
        }
    }
    assert!(compared > 40, "only {compared} constants were compared");
}

//! `info`: what was loaded and what was ignored, or what this program and machine can do.

use crate::cli::describe;
use crate::exit::Status;
use crate::machine::{self, Machine};
use crate::session::{self, Loaded};
use crate::{message, output, table};
use anyhow::Result;
use clap::Args;
use glam::{BVec3, Vec3};
use render::Method;
use scene::{Light, LightKind, Scene, SceneParts, generate};
use serde_json::json;
use std::fmt::Write;
use std::path::PathBuf;

/// Options of `info`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  manylight info                                   version, processor, generated scenes, samplers, environment
  manylight info hall.glb                          what was loaded, what was ignored and why
  manylight info demo:rooms --export rooms.glb     write a generated scene for other programs
  manylight info hall.glb --json | jq .lights")]
pub(crate) struct InfoArgs {
    /// A .gltf or .glb file, or demo:NAME[:LIGHTS[:SEED]]
    scene: Option<String>,
    /// Write the scene as a binary glTF file (.glb)
    #[arg(long, value_name = "FILE", requires = "scene")]
    export: Option<PathBuf>,
    /// Write everything as JSON
    #[arg(long)]
    json: bool,
    /// Threads that build; default: RAYON_NUM_THREADS, or all processors
    #[arg(long, value_name = "N", alias = "nthreads", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

/// Environment variables that matter, with what they do.
const ENVIRONMENT: [(&str, &str); 5] = [
    ("RAYON_NUM_THREADS", "threads, where --threads is not given"),
    ("NO_COLOR", "no colours in help and errors"),
    (
        "WGPU_BACKEND",
        "interfaces in which --backend gpu looks: vulkan, metal, dx12 or gl",
    ),
    ("WGPU_ADAPTER_NAME", "part of the name of the adapter that it takes"),
    ("XDG_CACHE_HOME", "folder in which bench keeps its references"),
];

/// Runs the command.
///
/// # Errors
/// A scene that cannot be loaded, an export that cannot be written.
pub(crate) fn run(args: &InfoArgs) -> Result<Status> {
    session::use_threads(args.threads)?;
    let Some(what) = &args.scene else {
        output::print(&if args.json { program_json()? } else { program_text() })?;
        return Ok(Status::Done);
    };
    if let Some(path) = &args.export {
        output::check_writable(path)?;
    }
    let loaded = session::load(what)?;
    output::print(&if args.json {
        scene_json(&loaded)?
    } else {
        scene_text(&loaded)
    })?;
    if let Some(path) = &args.export {
        scene::export::write_glb(&loaded.scene.parts, path)?;
        message::note(format!("{}: written", path.display()));
    }
    Ok(Status::Done)
}

fn program_text() -> String {
    let machine = Machine::detect();
    let mut text = format!(
        "manylight {}\n{}: {} logical processors, {} threads, SIMD {}\n\nGenerated scenes (demo:NAME[:LIGHTS[:SEED]]):\n",
        machine.version,
        machine.cpu,
        machine.logical_cpus,
        machine.threads,
        if machine.simd.is_empty() {
            "none".into()
        } else {
            machine.simd.join(" ")
        },
    );
    let mut section = |title: &str, rows: Vec<(String, String)>| {
        text.push_str(title);
        let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        for (name, what) in rows {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "  {name:width$}  {what}");
        }
    };
    section(
        "",
        generate::families()
            .map(|(name, what)| (format!("demo:{name}"), what.into()))
            .collect(),
    );
    section(
        "\nSamplers:\n",
        Method::all_and_research()
            .map(|m| (m.name().into(), describe(m).into()))
            .collect(),
    );
    let adapters = render::gpu::adapters();
    let of_none = || {
        vec![(
            "none".to_owned(),
            "--backend gpu needs a driver for Vulkan, Metal or Direct3D 12".to_owned(),
        )]
    };
    let listed: Vec<_> = adapters
        .iter()
        .map(|a| (a.name.clone(), format!("{}, {}, {}", a.kind, a.backend, a.driver)))
        .collect();
    section(
        "\nAdapters for --backend gpu:\n",
        if listed.is_empty() { of_none() } else { listed },
    );
    let variables = ENVIRONMENT.map(|(name, what)| {
        let value = std::env::var(name).map_or("not set".into(), |value| format!("= {value}"));
        (name.to_string(), format!("{what} ({value})"))
    });
    section("\nEnvironment:\n", variables.to_vec());
    text
}

fn program_json() -> Result<String> {
    let pairs = |all: Vec<(String, String)>| -> serde_json::Map<_, _> {
        all.into_iter().map(|(name, what)| (name, what.into())).collect()
    };
    let variables = ENVIRONMENT.map(|(name, _)| (name.to_string(), json!(std::env::var(name).ok())));
    let json = json!({
        "machine": Machine::detect(),
        "adapters": render::gpu::adapters(),
        "demos": pairs(generate::families().map(|(name, what)| (name.into(), what.into())).collect()),
        "samplers": pairs(Method::all_and_research().map(|m| (m.name().into(), describe(m).into())).collect()),
        "environment": serde_json::Map::from_iter(variables),
    });
    Ok(serde_json::to_string_pretty(&json)? + "\n")
}

fn scene_text(loaded: &Loaded) -> String {
    let Loaded { scene, what, load_s } = loaded;
    let (counts, parts) = (scene.counts(), &scene.parts);
    let number = table::thousands;
    let [low, high] = bounds(parts);
    let mut rows = vec![
        ("scene", format!("{} ({what})", parts.name)),
        (
            "triangles",
            format!(
                "{} ({} stored)",
                number(counts.triangles),
                number(counts.stored_triangles)
            ),
        ),
        ("meshes", number(parts.meshes.len() as u64)),
        ("instances", number(counts.instances)),
        ("materials", number(counts.materials)),
        ("textures", number(counts.textures)),
        ("lights", number(scene.lights.len() as u64)),
    ];
    for kind in kinds(scene) {
        rows.push((
            "",
            format!(
                "{} {}, {} W",
                number(kind.count),
                kind.name,
                table::number(kind.power_w)
            ),
        ));
    }
    if counts.textured_lights > 0 {
        rows.push((
            "",
            format!("{} of the triangles are textured", number(counts.textured_lights)),
        ));
    }
    for (index, camera) in parts.cameras.iter().enumerate() {
        let title = if index == 0 { "cameras" } else { "" };
        rows.push((
            title,
            format!(
                "{index} '{}', {:.1} degrees high",
                camera.name,
                camera.fov_y.to_degrees()
            ),
        ));
    }
    rows.push((
        "bounds",
        format!("{low:.3?} to {high:.3?} m, radius {:.3} m", scene.radius),
    ));
    rows.push((
        "memory",
        format!(
            "BVH {}, peak {}",
            table::mebibytes(scene.bvh().bytes() as u64),
            table::mebibytes(machine::peak_rss_bytes())
        ),
    ));
    rows.push(("time", format!("load {load_s:.3} s, BVH {:.3} s", scene.build_s)));
    let report = &parts.report;
    let ignored = report
        .ignored
        .iter()
        .map(|(what, count)| format!("{what} ({count}x): not supported"));
    for (title, texts) in [
        ("ignored", ignored.collect::<Vec<_>>()),
        ("warnings", report.warnings.clone()),
        ("skipped", report.skipped.clone()),
    ] {
        if texts.is_empty() && title != "skipped" {
            rows.push((title, "nothing".into()));
        }
        rows.extend(
            texts
                .into_iter()
                .enumerate()
                .map(|(i, text)| (if i == 0 { title } else { "" }, text)),
        );
    }
    rows.into_iter()
        .map(|(title, value)| format!("{title:<10} {value}\n"))
        .collect()
}

fn scene_json(loaded: &Loaded) -> Result<String> {
    let (scene, parts) = (&loaded.scene, &loaded.scene.parts);
    let [low, high] = bounds(parts);
    let kinds = kinds(scene).map(|k| (k.name, json!({ "count": k.count, "power_w": k.power_w })));
    let cameras = parts
        .cameras
        .iter()
        .map(|c| json!({ "name": c.name, "fov_y_degrees": c.fov_y.to_degrees() }));
    let json = json!({
        "scene": loaded.what,
        "name": parts.name,
        "counts": scene.counts(),
        "meshes": parts.meshes.len(),
        "lights": scene.lights.len(),
        "lights_by_kind": serde_json::Map::from_iter(kinds.map(|(name, value)| (name.to_string(), value))),
        "cameras": cameras.collect::<Vec<_>>(),
        "bounds_m": [low, high],
        "radius_m": scene.radius,
        "load_s": loaded.load_s,
        "build_s": scene.build_s,
        "bvh_bytes": scene.bvh().bytes(),
        "peak_rss_bytes": machine::peak_rss_bytes(),
        "ignored": parts.report.ignored,
        "warnings": parts.report.warnings,
        "skipped": parts.report.skipped,
        "version": machine::VERSION,
    });
    Ok(serde_json::to_string_pretty(&json)? + "\n")
}

/// The lights of one kind.
struct Kind {
    name: &'static str,
    count: u64,
    power_w: f64,
}

/// The kinds of lights there are in the scene.
fn kinds(scene: &Scene) -> impl Iterator<Item = Kind> {
    let all = [
        (LightKind::Triangle, "emissive triangles"),
        (LightKind::Point, "point"),
        (LightKind::Spot, "spot"),
        (LightKind::Directional, "directional"),
    ];
    let kind = |(kind, name)| {
        let lights = scene.lights.iter().filter(|light: &&Light| light.kind == kind);
        Kind {
            name,
            count: lights.clone().count() as u64,
            power_w: lights.map(|light| f64::from(light.power)).sum(),
        }
    };
    all.map(kind).into_iter().filter(|kind| kind.count > 0)
}

/// The corners of the box around all geometry, world space, metres; zeros without geometry. Of a mesh that is still in its file it is the box that
/// counts.
fn bounds(parts: &SceneParts) -> [[f32; 3]; 2] {
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for instance in &parts.instances {
        let mesh = &parts.meshes[instance.mesh as usize];
        let of_box = || {
            let [least, most] = mesh.bounds();
            (0..8).map(move |corner| {
                let pick = BVec3::from_array([1, 2, 4].map(|bit| corner & bit != 0));
                Vec3::select(pick, most, least)
            })
        };
        let positions: Box<dyn Iterator<Item = Vec3>> = match mesh.is_deferred() {
            true => Box::new(of_box()),
            false => Box::new(mesh.positions.iter().copied()),
        };
        for position in positions {
            let position = instance.world_from_local.transform_point3(position).to_array();
            for axis in 0..3 {
                low[axis] = low[axis].min(position[axis]);
                high[axis] = high[axis].max(position[axis]);
            }
        }
    }
    if low[0] > high[0] { [[0.0; 3]; 2] } else { [low, high] }
}

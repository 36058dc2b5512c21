//! Scenes whose meshes stay in their file until a ray comes near them: the same picture, and an error instead of a wrong one.

use glam::Vec3;
use render::{RenderError, Settings};
use scene::{PrimitiveId, Ray, Scene, export, generate, gltf};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A small city as a file.
fn city() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("city.glb");
    let parts = generate::demo("city:300").expect("the scene is known");
    export::write_glb(&parts, &path).expect("there is room");
    (folder, path)
}

/// The scene with all meshes of at least a thousand triangles left in the file.
fn deferred(path: &Path) -> Scene {
    Scene::new(gltf::read_above(path, 0).expect("readable")).expect("valid")
}

/// Rays all over the city, in all directions.
fn rays() -> impl Iterator<Item = Ray> {
    let fraction = |i: u32, irrational: f64| (f64::from(i) * irrational).fract() as f32;
    (0..4_000).map(move |i| {
        let origin_ws = Vec3::new(
            60.0 * fraction(i, 0.754_877_666) - 30.0,
            0.5 + 14.0 * fraction(i, 0.569_840_291),
            60.0 * fraction(i, 0.380_113_7) - 30.0,
        );
        let z = 2.0 * fraction(i, 0.618_033_989) - 1.0;
        let (sin, cos) = (std::f32::consts::TAU * fraction(i, 0.414_213_562)).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Ray {
            origin_ws,
            direction_ws: Vec3::new(r * cos, z, r * sin).normalize(),
            t_max: f32::INFINITY,
        }
    })
}

#[test]
fn rays_meet_the_same_surfaces() {
    let (_folder, path) = city();
    let (whole, deferred) = (
        scene::load(path.to_str().expect("UTF-8")).expect("valid"),
        deferred(&path),
    );
    assert!(whole.parts.meshes.iter().all(|mesh| !mesh.is_deferred()));
    let left = deferred.parts.meshes.iter().filter(|mesh| mesh.is_deferred()).count();
    assert!(left >= 2, "{left}");
    assert_eq!(whole.counts().triangles, deferred.counts().triangles);
    assert_eq!(whole.lights.len(), deferred.lights.len());
    let before = deferred.bvh().built();
    assert!((whole.radius / deferred.radius - 1.0).abs() < 1e-4);
    let (mut apart, mut met) = (0, 0);
    for ray in rays() {
        let [a, b] = [&whole, &deferred].map(|scene| {
            let hit = scene.nearest(&ray, PrimitiveId::NONE)?;
            let surface = scene.surface(&ray, &hit);
            Some((
                hit.t,
                surface.geometric_normal_ws,
                surface.bsdf.diffuse,
                surface.emitted,
            ))
        });
        let same = match (&a, &b) {
            (Some(a), Some(b)) => {
                (a.0 - b.0).abs() < 1e-3 * (1.0 + a.0) && a.1.distance(b.1) < 1e-3 && (a.2, a.3) == (b.2, b.3)
            }
            (None, None) => true,
            _ => false,
        };
        met += u32::from(a.is_some());
        apart += u32::from(!same);
    }
    // Vertices are moved by rounding, and a ray along an edge meets either face.
    assert!(apart <= 4 && met > 2_000, "{apart} of {met}");
    assert!(deferred.bvh().built() > before && deferred.fault().is_none());
}

#[test]
fn nothing_is_read_that_no_ray_comes_near() {
    let (_folder, path) = city();
    let scene = deferred(&path);
    let up = Ray {
        origin_ws: Vec3::new(0.0, 200.0, 0.0),
        direction_ws: Vec3::Y,
        t_max: f32::INFINITY,
    };
    let before = scene.bvh().built();
    assert!(scene.nearest(&up, PrimitiveId::NONE).is_none());
    assert!(!scene.occluded(&up, PrimitiveId::NONE, PrimitiveId::NONE));
    assert_eq!(scene.bvh().built(), before);
    scene.build_all();
    assert!(scene.bvh().built() > before);
}

#[test]
fn a_file_that_is_gone_ends_the_rendering_with_an_error() {
    let (folder, path) = city();
    let scene = deferred(&path);
    drop(folder);
    let settings = Settings {
        width: 32,
        height: 24,
        ..Settings::default()
    };
    let above = &scene.parts.cameras[1];
    let mut frames = render::renderer(&scene, above, &settings).expect("the settings are valid");
    assert!(frames.error().is_none());
    frames.render_frame();
    match frames.error() {
        Some(RenderError::Scene(text)) => assert!(text.contains("city.glb") && text.contains("changed"), "{text}"),
        other => panic!("{other:?}"),
    }
    let error = export::write_glb(&scene.parts, &path).expect_err("its meshes cannot be read");
    assert!(error.to_string().contains("changed"), "{error}");
}

#[test]
fn a_box_that_is_too_small_is_an_error_and_names_the_mesh() {
    let (_folder, path) = city();
    let mut bytes = std::fs::read(&path).expect("readable");
    let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    let text = String::from_utf8(bytes[20..20 + length].to_vec()).expect("JSON");
    let mut json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let meshes = json["meshes"].as_array().expect("meshes");
    // The house of the room has that name too, and is small enough to be read at once.
    let mesh = meshes.iter().rposition(|mesh| mesh["name"] == "house");
    for primitive in json["meshes"][mesh.expect("a house")]["primitives"]
        .as_array()
        .expect("primitives")
        .clone()
    {
        let accessor = primitive["attributes"]["POSITION"].as_u64().expect("an index") as usize;
        let highest = &mut json["accessors"][accessor]["max"][1];
        // Still above min, or the claim would be plainly wrong and the mesh read at once.
        *highest = (0.995 * highest.as_f64().expect("a number")).into();
    }
    let mut changed = json.to_string().into_bytes();
    changed.resize(changed.len().next_multiple_of(4), b' ');
    bytes[12..16].copy_from_slice(&(changed.len() as u32).to_le_bytes());
    bytes.splice(20..20 + length, changed);
    let total = bytes.len() as u32;
    bytes[8..12].copy_from_slice(&total.to_le_bytes());
    std::fs::write(&path, bytes).expect("writable");
    let scene = deferred(&path);
    assert!(scene.fault().is_none());
    scene.build_all();
    let fault = scene.fault().expect("it lies").to_string();
    assert!(fault.contains("'house'") && fault.contains("min, max"), "{fault}");
}

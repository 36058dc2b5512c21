use super::*;
use crate::{Light, PrimitiveId, Ray, Scene, luminance};
use glam::Vec3;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Lights of a scene: emissive triangles and punctual lights.
fn lights(parts: &SceneParts) -> usize {
    let emissive = |&material: &u32| parts.materials[material as usize].emits();
    let of_mesh: Vec<usize> = parts
        .meshes
        .iter()
        .map(|m| m.materials.iter().filter(|m| emissive(m)).count())
        .collect();
    let triangles = parts.instances.iter().map(|i| of_mesh[i.mesh as usize]);
    triangles.sum::<usize>() + parts.punctual.len()
}

fn triangles(parts: &SceneParts) -> usize {
    parts.meshes.iter().map(|mesh| mesh.len()).sum()
}

fn make(what: &str) -> SceneParts {
    demo(what).unwrap_or_else(|error| panic!("{error}"))
}

/// A few small scenes of every family.
fn small() -> Vec<String> {
    FAMILIES
        .iter()
        .flat_map(|family| match family.default {
            1 => vec![family.name.to_string()],
            _ => ["16", "17", "203:5"]
                .map(|lights| format!("{}:{lights}", family.name))
                .to_vec(),
        })
        .collect()
}

fn fingerprint(parts: &SceneParts) -> u64 {
    let mut hasher = DefaultHasher::new();
    for mesh in &parts.meshes {
        for v in mesh.positions.iter().chain(&mesh.normals) {
            v.to_array().map(f32::to_bits).hash(&mut hasher);
        }
        (&mesh.indices, &mesh.materials, &mesh.origins).hash(&mut hasher);
    }
    parts.origins.hash(&mut hasher);
    format!("{:?} {:?} {:?}", parts.materials, parts.punctual, parts.cameras).hash(&mut hasher);
    format!("{:?}", parts.instances).hash(&mut hasher);
    hasher.finish()
}

#[test]
fn number_of_lights_is_exactly_the_one_asked_for() {
    for family in FAMILIES {
        assert_eq!(lights(&make(family.name)), family.default, "{}", family.name);
        for count in [16, 17, 18, 19, 31, 64, 100, 255, 1001, 4096, 20_003] {
            if family.lights.contains(&count) {
                let what = format!("{}:{count}", family.name);
                assert_eq!(lights(&make(&what)), count, "{what}");
            }
        }
    }
}

#[test]
fn same_name_same_bits_and_seeds_differ() {
    for what in small() {
        assert_eq!(fingerprint(&make(&what)), fingerprint(&make(&what)), "{what}");
    }
    for family in FAMILIES {
        let count = family.default;
        let [a, b] = [1, 2].map(|seed| fingerprint(&make(&format!("{}:{count}:{seed}", family.name))));
        assert_ne!(a, b, "{}", family.name);
    }
}

#[test]
fn scenes_are_the_same_on_every_machine() {
    // Positions of one scene, as first generated: any change of the generators changes them, any platform must not.
    let mut sum = 0u64;
    for p in &make("rooms:64:3").meshes[0].positions {
        for bits in p.to_array().map(f32::to_bits) {
            sum = sum.rotate_left(5).wrapping_add(u64::from(bits));
        }
    }
    assert_eq!(sum, 9_328_657_499_764_400_915);
}

#[test]
fn solids_are_closed_and_sound() {
    for what in small() {
        let parts = make(&what);
        for mesh in &parts.meshes {
            assert_closed_and_sound(&what, &parts, mesh);
        }
    }
}

fn assert_closed_and_sound(what: &str, parts: &SceneParts, mesh: &crate::Mesh) {
    assert!(mesh.normals.is_empty() || mesh.positions.len() == mesh.normals.len());
    let mut edges = std::collections::BTreeMap::new();
    let mut seen = std::collections::BTreeSet::new();
    for i in 0..mesh.len() {
        let corners = mesh.corners(i);
        let [a, b, c] = corners;
        assert!(corners.iter().all(|p| p.is_finite()), "{what}: triangle {i}");
        let area = 0.5 * (b - a).cross(c - a).length();
        let origin = mesh.origins.get(i).map(|&origin| &parts.origins[origin as usize]);
        let what = format!("{what}, mesh '{}', {origin:?}", mesh.name);
        assert!(area > 1e-9, "{what}: triangle {i}");
        let bits = corners.map(|p| p.to_array().map(f32::to_bits));
        let mut sorted = bits;
        sorted.sort_unstable();
        assert!(seen.insert(sorted), "{what}: triangle {i} twice");
        if !parts.materials[mesh.materials[i] as usize].emits() {
            for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                *edges.entry((bits[from], bits[to])).or_insert(0) += 1;
                *edges.entry((bits[to], bits[from])).or_insert(0) -= 1;
            }
        }
    }
    // In closed solids every edge is walked as often one way as the other.
    let open = edges.values().filter(|&&balance| balance != 0).count();
    assert_eq!(open, 0, "{what}: {open} open edges");
    for normal in &mesh.normals {
        assert!(*normal == Vec3::ZERO || (normal.length() - 1.0).abs() < 1e-5);
    }
}

/// Distance to the nearest triangle along a ray, and whether it was met from its front. By brute force.
fn look(parts: &SceneParts, origin: Vec3, direction: Vec3) -> Option<(f32, bool)> {
    let placed = parts.instances.iter().flat_map(|instance| {
        let mesh = &parts.meshes[instance.mesh as usize];
        let place = instance.world_from_local;
        (0..mesh.len()).map(move |i| mesh.corners(i).map(|p| place.transform_point3(p)))
    });
    let hits = placed.filter_map(|[a, b, c]| {
        let (e1, e2) = (b - a, c - a);
        let p = direction.cross(e2);
        let det = e1.dot(p);
        let s = origin - a;
        let (u, q) = (s.dot(p) / det, s.cross(e1));
        let (v, t) = (direction.dot(q) / det, e2.dot(q) / det);
        (det != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some((t, det > 0.0))
    });
    hits.min_by(|a, b| a.0.total_cmp(&b.0))
}

#[test]
fn cameras_stand_in_free_space_and_see_something() {
    for what in small() {
        let parts = make(&what);
        assert!(!parts.cameras.is_empty(), "{what}");
        for camera in &parts.cameras {
            let eye = Vec3::from(camera.world_from_camera.translation);
            for direction in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
                // Slightly askew, so that no ray runs along an edge.
                let direction = (direction + Vec3::new(0.013, 0.017, 0.011)).normalize();
                if let Some((t, front)) = look(&parts, eye, direction) {
                    assert!(t > 0.2 && front, "{what}: {} looks out of a solid", camera.name);
                }
            }
            let ahead = -Vec3::from(camera.world_from_camera.matrix3.z_axis);
            assert!(
                look(&parts, eye, ahead).is_some_and(|(t, _)| t > 1.0),
                "{what}: {}",
                camera.name
            );
        }
    }
}

#[test]
fn every_storey_lies_between_its_slabs() {
    let parts = make("rooms");
    let mesh = &parts.meshes[0];
    let bounds = |slabs: bool| {
        let chosen = (0..mesh.len()).filter(|&i| !slabs || parts.origins[mesh.origins[i] as usize].1 == "slab");
        chosen
            .flat_map(|i| mesh.corners(i))
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| {
                (low.min(p), high.max(p))
            })
    };
    assert_eq!(bounds(true), bounds(false));
}

#[test]
fn a_building_of_a_million_lights_stays_small() {
    for what in ["rooms:1000000", "sun-outside:1000000"] {
        let parts = make(what);
        assert_eq!(lights(&parts), 1_000_000);
        assert!(triangles(&parts) <= 2_500_000, "{what}: {}", triangles(&parts));
        assert!(parts.origins.len() <= 50_000, "{what}: {}", parts.origins.len());
        assert!(parts.materials.len() <= 2_000, "{what}: {}", parts.materials.len());
    }
}

#[test]
fn the_sun_is_a_thousand_times_all_lamps_and_never_comes_in() {
    let parts = make("sun-outside:64");
    let scene = Scene::new(parts).unwrap();
    let (sun, lamps): (Vec<&Light>, Vec<&Light>) = scene.lights.iter().partition(|light| light.area > 100.0);
    assert_eq!(sun.len(), 1);
    let total: f32 = lamps.iter().map(|light| light.power).sum();
    assert!((sun[0].power / total / 1000.0 - 1.0).abs() < 0.01);
    // From points on the sun to points below the lamps: something stands between.
    let mut dice = dice::Dice::new(&[7]);
    let sun = sun[0];
    for _ in 0..20_000 {
        let (u, v) = (dice.unit(), dice.unit());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let from = sun.position_ws + sun.edge1_ws * u + sun.edge2_ws * v;
        let lamp = lamps[dice.below(lamps.len())];
        let to = lamp.center_ws() - Vec3::Y * dice.range(0.05, 2.4);
        let ray = Ray {
            origin_ws: from,
            direction_ws: (to - from).normalize(),
            t_max: from.distance(to),
        };
        assert!(scene.occluded(&ray, sun.primitive, PrimitiveId::NONE));
    }
}

#[test]
fn powers_on_the_square_span_three_decades() {
    let scene = Scene::new(make("plaza")).unwrap();
    let mut powers: Vec<f32> = scene.lights.iter().map(|light| light.power).collect();
    powers.sort_by(f32::total_cmp);
    let span = powers[powers.len() - 1] / powers[0];
    assert!((1e3..1e5).contains(&span), "{span}");
}

#[test]
fn lamp_colours_have_luminance_one() {
    for color in [fixtures::WARM, fixtures::NEUTRAL, fixtures::COOL] {
        assert!((luminance(color) - 1.0).abs() < 0.06, "{color}: {}", luminance(color));
    }
}

#[test]
fn bad_requests_name_the_problem_and_the_scenes() {
    for (what, problem) in [
        ("", "no generated scene"),
        ("room", "no generated scene 'room'"),
        ("rooms:many", "'many' is no number"),
        ("rooms:-5", "'-5' is no number"),
        ("rooms:15", "16 to 1000000"),
        ("rooms:1000001", "16 to 1000000"),
        ("one-light:2", "1 to 1 "),
        ("rooms:64:x", "'x' is no seed"),
        ("rooms:64:1:2", "'2' is one field too many"),
    ] {
        let message = demo(what).unwrap_err().to_string();
        assert!(message.contains(problem), "{message}");
        for name in names() {
            assert!(message.contains(name), "{message}");
        }
    }
}

#[test]
fn a_shut_door_leaves_the_lights_as_they_are_and_the_open_way_shut() {
    for what in ["rooms:64", "points:64:3", "keyhole:64"] {
        let (open, shut) = (demo(what).unwrap(), super::shut(what).unwrap());
        let [open, shut] = [open, shut].map(|parts| crate::Scene::new(parts).unwrap());
        let places = |scene: &crate::Scene| scene.lights.iter().map(|l| (l.kind, l.center_ws())).collect::<Vec<_>>();
        assert_eq!(places(&open), places(&shut), "{what}");
        assert_eq!(shut.triangle_count(), open.triangle_count() + 12, "{what}");
    }
    for what in ["plaza:64", "one-light", "sun-outside:64"] {
        assert!(super::shut(what).unwrap_err().to_string().contains("keyhole"), "{what}");
    }
}

#[test]
fn a_walk_meets_no_wall() {
    for what in ["rooms:2048", "rooms:64:5", "points:300", "sun-outside:2048"] {
        let scene = crate::Scene::new(demo(what).unwrap()).unwrap();
        let walk = super::walk(what).unwrap();
        assert!(walk.len() >= 3, "{what}");
        let eye: Vec3 = scene.parts.cameras[0].world_from_camera.translation.into();
        assert_eq!(walk[0], eye, "{what}");
        for step in walk.windows(2) {
            let way = step[1] - step[0];
            let ray = crate::Ray {
                origin_ws: step[0],
                direction_ws: way.normalize(),
                t_max: way.length(),
            };
            let hit = scene.nearest(&ray, crate::PrimitiveId::NONE);
            assert!(hit.is_none(), "{what}: {step:?}");
        }
    }
    assert!(super::walk("plaza").is_err());
}

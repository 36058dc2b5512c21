use super::*;
use crate::texture::TextureRef;
use glam::{Affine3A, Mat2, Quat, Vec4};
use std::sync::Arc;

/// A square of side 2 around the origin, front towards +z, by two triangles.
fn square(material: u32) -> Mesh {
    Mesh {
        name: "square".into(),
        positions: vec![
            Vec3::new(-1.0, -1.0, 0.0),
            Vec3::new(1.0, -1.0, 0.0),
            Vec3::new(1.0, 1.0, 0.0),
            Vec3::new(-1.0, 1.0, 0.0),
        ],
        indices: vec![[0, 1, 2], [0, 2, 3]],
        uvs: vec![
            Vec2::new(0.0, 1.0),
            Vec2::new(1.0, 1.0),
            Vec2::new(1.0, 0.0),
            Vec2::new(0.0, 0.0),
        ],
        materials: vec![material; 2],
        ..Mesh::default()
    }
}

fn parts(materials: Vec<Material>, transforms: &[Affine3A]) -> SceneParts {
    SceneParts {
        name: "test".into(),
        meshes: vec![square(0).into()],
        instances: transforms.iter().map(|&t| Instance::new(0, 0, t).unwrap()).collect(),
        materials,
        origins: vec![("lamp".into(), "square".into())],
        ..SceneParts::default()
    }
}

fn glow() -> Material {
    Material::emitter("glow", Vec3::new(1.0, 2.0, 3.0))
}

fn look(from: Vec3, to: Vec3) -> Ray {
    Ray {
        origin_ws: from,
        direction_ws: (to - from).normalize(),
        t_max: f32::INFINITY,
    }
}

fn see(scene: &Scene, from: Vec3, to: Vec3) -> Option<crate::Surface> {
    let ray = look(from, to);
    scene
        .nearest(&ray, PrimitiveId::NONE)
        .map(|hit| scene.surface(&ray, &hit))
}

#[test]
fn a_hit_is_resolved_wherever_the_mesh_is_placed() {
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.4, -0.9, 2.0);
    for scale in [
        Vec3::ONE,
        Vec3::new(0.5, 2.0, 1.5),
        Vec3::new(-1.0, 1.0, 1.0),
        Vec3::splat(-2.0),
    ] {
        let place = Affine3A::from_scale_rotation_translation(scale, turn, Vec3::new(3.0, -5.0, 9.0));
        for place in [Affine3A::IDENTITY, place] {
            let scene = Scene::new(parts(vec![glow()], &[place])).unwrap();
            assert_eq!(scene.lights.len(), 2);
            let front = (Instance::new(0, 0, place).unwrap().world_normal_from_local * Vec3::Z).normalize();
            let target = place.transform_point3(Vec3::new(0.3, 0.4, 0.0));
            let eye = target + front * 4.0 + place.transform_vector3(Vec3::X);
            let surface = see(&scene, eye, target).expect("the front is there");
            assert!((surface.position_ws - target).length() < 1e-5);
            assert!((surface.geometric_normal_ws - front).length() < 1e-5);
            assert!((surface.bsdf.normal_ws - front).length() < 1e-5);
            assert_eq!(surface.emitted, Vec3::new(1.0, 2.0, 3.0));
            let light = &scene.lights[surface.light as usize];
            assert_eq!(light.primitive, surface.id);
            assert!((light.normal_ws - front).length() < 1e-5);
            // What the ray found, next-event estimation finds too.
            assert!(
                light.sample(eye, Vec2::splat(0.3)).is_some()
                    && light.pdf_solid_angle(eye, (target - eye).normalize(), 4.0) > 0.0
            );
            // One-sided: not there from behind, and dark.
            let behind = target - front * 4.0;
            assert!(see(&scene, behind, target).is_none());
            assert!(light.sample(behind, Vec2::splat(0.3)).is_none());
        }
    }
}

#[test]
fn double_sided_emitters_shine_both_ways() {
    let material = Material {
        double_sided: true,
        ..glow()
    };
    let scene = Scene::new(parts(vec![material], &[Affine3A::IDENTITY])).unwrap();
    for z in [3.0, -3.0] {
        let surface = see(&scene, Vec3::new(0.1, 0.2, z), Vec3::new(0.1, 0.2, 0.0)).unwrap();
        assert_eq!(surface.emitted, Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(surface.geometric_normal_ws, Vec3::Z * z.signum());
    }
}

#[test]
fn rays_leave_on_the_right_side_at_any_scale() {
    for scale in [1e-3, 1.0, 1e4] {
        for shift in [0.0, 10.0] {
            let place = Affine3A::from_scale_rotation_translation(
                Vec3::splat(scale),
                Quat::from_rotation_y(0.7),
                Vec3::splat(shift * scale),
            );
            let scene = Scene::new(parts(vec![Material::lambert("grey", Vec3::splat(0.5))], &[place])).unwrap();
            let target = place.transform_point3(Vec3::new(0.31, 0.17, 0.0));
            let normal = place.transform_vector3(Vec3::Z).normalize();
            let surface = see(&scene, target + normal * scale * 3.0, target).unwrap();
            for wi in [
                normal,
                -normal,
                (normal + surface.geometric_normal_ws.any_orthonormal_vector() * 50.0).normalize(),
            ] {
                let ray = scene.ray_from(&surface, wi, 1.0);
                let height = (ray.origin_ws - target).dot(normal) * wi.dot(normal).signum();
                assert!(
                    height > 0.0 && height < 1e-3 * scale,
                    "scale {scale} shift {shift}: {height}"
                );
                // Even with nothing skipped the ray does not meet what it leaves.
                assert!(!scene.occluded(&ray, PrimitiveId::NONE, PrimitiveId::NONE));
            }
        }
    }
}

/// From beyond a wall rays reach what lies outside. Rays from inside to the very edges of a box, near the origin and far from it.
#[test]
fn no_ray_starts_beyond_the_wall_next_to_it() {
    for offset in [0.0, 100.0] {
        let low = Vec3::splat(offset);
        let mut builder = crate::assemble::Builder::default();
        let wall = builder.material(Material::lambert("wall", Vec3::splat(0.8)));
        builder.room(low, low + Vec3::new(3.0, 2.0, 2.5), wall);
        let scene = builder.build().expect("it is valid");
        let corners = &scene.parts.meshes[0].positions;
        let low = corners.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let high = corners.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        let mut seen = 0;
        for i in 0..40_000 {
            let random = sampling::Random::new(7, i, 0);
            let [from, to] = [0, 3].map(|d| Vec3::from_array([0, 1, 2].map(|axis| random.f32(d + axis))));
            let from = low + (high - low) * (0.02 + 0.96 * from);
            // On one of the twelve edges: two coordinates are those of walls.
            let free = i as usize % 3;
            let mut to = low + (high - low) * to;
            for (n, axis) in [(free + 1) % 3, (free + 2) % 3].into_iter().enumerate() {
                to[axis] = if i >> (3 + n) & 1 == 0 { low[axis] } else { high[axis] };
            }
            let Some(surface) = see(&scene, from, to) else { continue };
            let toward = (from - surface.position_ws).normalize();
            for ray in [
                scene.ray_from(&surface, toward, f32::INFINITY),
                scene.shadow_ray(&surface, toward, 1.0),
            ] {
                let start = ray.origin_ws;
                assert!(
                    start.cmpgt(low).all() && start.cmplt(high).all(),
                    "{start} from {from} to {to}"
                );
            }
            seen += 1;
        }
        assert!(seen > 39_000, "{seen}");
    }
}

#[test]
fn lights_are_in_a_stable_order_along_a_curve() {
    let mut dice = parts(vec![glow()], &[Affine3A::IDENTITY]);
    let random = sampling::random::Random::new(1, 0, 0);
    let place = |i: u32| Vec3::new(random.f32(3 * i), random.f32(3 * i + 1), random.f32(3 * i + 2)) * 20.0;
    dice.punctual = (0..500)
        .map(|i| (Light::point(place(i), Vec3::ONE, f32::INFINITY), LightSource::default()))
        .collect();
    let source = LightSource {
        node: "sun".into(),
        ..LightSource::default()
    };
    dice.punctual.push((Light::directional(Vec3::NEG_Y, Vec3::ONE), source));
    let scene = Scene::new(dice.clone()).unwrap();
    assert_eq!(scene.lights.len(), 503);
    assert_eq!(scene.lights[0].kind, LightKind::Directional);
    assert_eq!(scene.light_source(0).node, "sun");
    assert!((scene.lights[0].power / (std::f32::consts::PI * scene.radius * scene.radius) - 1.0).abs() < 1e-5);
    // Another order in the file, the same order here.
    dice.punctual.reverse();
    let other = Scene::new(dice).unwrap();
    let centers = |scene: &Scene| scene.lights.iter().map(Light::center_ws).collect::<Vec<_>>();
    assert_eq!(centers(&scene), centers(&other));
    let length = |list: &[Vec3]| list.windows(2).map(|w| w[0].distance(w[1])).sum::<f32>();
    let shuffled: Vec<Vec3> = (0..500).map(place).collect();
    assert!(
        length(&centers(&scene)[1..]) < 0.5 * length(&shuffled),
        "neighbours in the order are not neighbours in space"
    );
    // Hits on the emissive triangles lead to their lights.
    let surface = see(&scene, Vec3::new(0.5, 0.1, 0.4), Vec3::new(0.5, 0.1, 0.0)).unwrap();
    assert_eq!(scene.lights[surface.light as usize].primitive, surface.id);
}

#[test]
fn splitting_an_emitter_keeps_its_power() {
    let whole = Scene::new(parts(vec![glow()], &[Affine3A::IDENTITY])).unwrap();
    let quarter = |x: f32, y: f32| {
        Affine3A::from_scale_rotation_translation(Vec3::splat(0.5), Quat::IDENTITY, Vec3::new(x, y, 0.0))
    };
    let split = Scene::new(parts(
        vec![glow()],
        &[
            quarter(0.5, 0.5),
            quarter(-0.5, 0.5),
            quarter(0.5, -0.5),
            quarter(-0.5, -0.5),
        ],
    ))
    .unwrap();
    let power = |scene: &Scene| scene.lights.iter().map(|l| f64::from(l.power)).sum::<f64>();
    assert_eq!((whole.lights.len(), split.lights.len()), (2, 8));
    assert!((power(&whole) / power(&split) - 1.0).abs() < 1e-6);
}

/// A chequered emitter: left half dark, right half bright.
fn screen() -> SceneParts {
    let reference = TextureRef {
        texture: 0,
        uv_set: 0,
        columns: Mat2::IDENTITY,
        offset: Vec2::ZERO,
    };
    let mut parts = parts(
        vec![Material {
            emissive_texture: Some(reference),
            ..glow()
        }],
        &[Affine3A::IDENTITY],
    );
    parts.textures = vec![Texture {
        name: "screen".into(),
        width: 2,
        height: 1,
        texels: vec![[0, 0, 0, 255], [255, 255, 255, 255]].into(),
        srgb: true,
        wrap: Default::default(),
        nearest: true,
    }];
    parts
}

#[test]
fn textured_emitters_count_by_their_mean_and_shine_by_their_texel() {
    let scene = Scene::new(screen()).unwrap();
    assert_eq!(scene.counts().textured_lights, 2);
    // The lower right triangle is bright in 3/4 of its area, the upper left one in 1/4.
    let mut means: Vec<f32> = scene.lights.iter().map(|l| l.intensity.x).collect();
    means.sort_by(f32::total_cmp);
    assert!(
        (means[0] - 0.25).abs() < 0.02 && (means[1] - 0.75).abs() < 0.02,
        "{means:?}"
    );
    let eye = Vec3::new(0.0, 0.0, 1.0);
    for (x, bright) in [(0.5, 1.0), (-0.5, 0.0)] {
        assert_eq!(see(&scene, eye, Vec3::new(x, 0.3, 0.0)).unwrap().emitted.x, bright);
    }
    let random = sampling::random::Random::new(1, 0, 0);
    let mut seen = 0;
    for i in 0..1000 {
        let index = i % 2;
        if let Some(point) = scene.sample_light(index, eye, random.vec2(2 * i)) {
            seen += 1;
            let x = eye.x + point.wi_ws.x * point.distance;
            assert!(
                x > -1e-4 && point.radiance == Vec3::new(1.0, 2.0, 3.0),
                "light from the dark half: {x}"
            );
        }
    }
    assert!((400..600).contains(&seen), "{seen}");
    // All dark: no light at all.
    let mut dark = screen();
    dark.textures[0].texels = vec![[0, 0, 0, 255]; 2].into();
    let dark = Scene::new(dark).unwrap();
    assert!(dark.lights.is_empty() && dark.parts.report.warnings.is_empty());
    assert_eq!(see(&dark, eye, Vec3::ZERO).unwrap().emitted, Vec3::ZERO);
}

#[test]
fn tiny_emitters_are_seen_but_not_sampled() {
    let mut small = parts(vec![glow()], &[Affine3A::IDENTITY]);
    let mesh = &mut small.meshes[0];
    let corner = Vec3::new(3.0, 0.0, 0.0);
    mesh.positions
        .extend([corner, corner + Vec3::X * 1e-11, corner + Vec3::Y]);
    mesh.uvs.extend([Vec2::ZERO; 3]);
    mesh.indices.push([4, 4, 6]);
    mesh.materials.push(0);
    let scene = Scene::new(small).unwrap();
    assert_eq!(scene.lights.len(), 2);
    assert!(
        scene.parts.report.warnings.iter().any(|w| w.contains("without area")),
        "{:?}",
        scene.parts.report
    );
}

#[test]
fn sources_name_the_place_in_the_file() {
    let mut named = parts(
        vec![
            glow(),
            Material {
                name: "neon".into(),
                ..glow()
            },
        ],
        &[Affine3A::IDENTITY],
    );
    named.meshes[0].materials[1] = 1;
    named.meshes[0].origins = vec![0, 1];
    named.origins.push(("sign".into(), "letters".into()));
    let scene = Scene::new(named).unwrap();
    for (index, light) in scene.lights.iter().enumerate() {
        let source = scene.light_source(index as u32);
        let expected = [("lamp", "square", "glow"), ("sign", "letters", "neon")][light.primitive.triangle as usize];
        assert_eq!(
            (&*source.node, &*source.mesh, &*source.material, source.triangle),
            (expected.0, expected.1, expected.2, 0)
        );
    }
}

#[test]
fn unusable_parts_are_refused_with_their_place() {
    type Break = Arc<dyn Fn(&mut SceneParts)>;
    let cases: [(&str, Break); 9] = [
        ("vertex 9", Arc::new(|p| p.meshes[0].indices[1][2] = 9)),
        ("material 7", Arc::new(|p| p.meshes[0].materials[0] = 7)),
        ("mesh 3", Arc::new(|p| p.instances[0].mesh = 3)),
        ("origin 4", Arc::new(|p| p.instances[0].origin = 4)),
        (
            "position of vertex 2",
            Arc::new(|p| p.meshes[0].positions[2].y = f32::NAN),
        ),
        (
            "position of vertex 1",
            Arc::new(|p| p.meshes[0].positions[1].y = f32::INFINITY),
        ),
        (
            "3 normals for 4 vertices",
            Arc::new(|p| p.meshes[0].normals = vec![Vec3::Z; 3]),
        ),
        (
            "transform is not finite",
            Arc::new(|p| p.instances[0].world_from_local.translation.x = f32::NAN),
        ),
        (
            "texture 5",
            Arc::new(|p| p.materials[0].emissive_texture.as_mut().unwrap().texture = 5),
        ),
    ];
    for (expected, break_it) in cases {
        let mut parts = screen();
        break_it(&mut parts);
        let error = Scene::new(parts).unwrap_err().to_string();
        assert!(error.contains(expected), "'{error}' does not say '{expected}'");
    }
    assert!(Scene::new(screen()).is_ok());
}

#[test]
fn lesser_faults_are_repaired_with_a_warning() {
    let mut parts = parts(
        vec![glow()],
        &[Affine3A::IDENTITY, Affine3A::from_scale(Vec3::splat(2.0))],
    );
    parts.materials[0].emission = Vec3::new(f32::NAN, 2.0, -1.0);
    parts.meshes[0].normals = vec![Vec3::Z * 3.0, Vec3::NAN, Vec3::Z, Vec3::ZERO];
    parts.instances[1].world_from_local = Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0));
    let scene = Scene::new(parts).unwrap();
    assert_eq!(scene.parts.materials[0].emission, Vec3::new(0.0, 2.0, 0.0));
    assert!(
        scene.parts.meshes[0]
            .normals
            .iter()
            .all(|n| *n == Vec3::ZERO || n.is_normalized())
    );
    assert_eq!(scene.parts.instances.len(), 1);
    let report = &scene.parts.report;
    for word in ["emission", "normals not finite", "squashed flat"] {
        assert!(
            report.warnings.iter().any(|w| w.contains(word)),
            "no '{word}' in {:?}",
            report.warnings
        );
    }
    assert!(
        report.skipped.iter().any(|s| s.starts_with("no instancing")),
        "{:?}",
        report.skipped
    );
}

#[test]
fn an_empty_scene_is_a_scene() {
    let scene = Scene::new(SceneParts::default()).unwrap();
    assert!(scene.lights.is_empty() && scene.radius > 0.0 && scene.center_ws.is_finite());
    assert!(scene.nearest(&look(Vec3::ZERO, Vec3::X), PrimitiveId::NONE).is_none());
    assert_eq!(scene.counts(), Counts::default());
}

/// A sphere with interpolated normals: seen from anywhere, shading and geometric normal look at the viewer.
#[test]
fn shading_normals_never_face_away() {
    let (rings, around) = (6, 8);
    let mut mesh = Mesh::default();
    for i in 0..=rings {
        for j in 0..around {
            let (theta, phi) = (
                i as f32 / rings as f32 * std::f32::consts::PI,
                j as f32 / around as f32 * std::f32::consts::TAU,
            );
            let normal = Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            mesh.positions.push(normal);
            mesh.normals.push(normal);
        }
    }
    for i in 0..rings {
        for j in 0..around {
            let (a, b) = (i * around + j, i * around + (j + 1) % around);
            mesh.indices
                .extend([[a, a + around, b], [b, a + around, b + around]].map(|t| t.map(|v| v as u32)));
        }
    }
    mesh.materials = vec![0; mesh.indices.len()];
    let mut parts = parts(vec![Material::lambert("grey", Vec3::splat(0.5))], &[Affine3A::IDENTITY]);
    parts.meshes[0] = mesh.into();
    let scene = Scene::new(parts).unwrap();
    let random = sampling::random::Random::new(1, 0, 0);
    let (mut smooth, mut bent) = (0, 0);
    for i in 0..4000 {
        let eye = sampling::hemisphere::uniform_sphere(random.vec2(4 * i)) * 3.0;
        let at = sampling::hemisphere::uniform_sphere(random.vec2(4 * i + 2)) * 0.95;
        let Some(surface) = see(&scene, eye, at) else { continue };
        let (wo, shading) = ((eye - at).normalize(), surface.bsdf.normal_ws);
        assert!(shading.is_normalized() && shading.dot(wo) > 0.0 && shading.dot(surface.geometric_normal_ws) > 0.0);
        assert!(surface.geometric_normal_ws.dot(wo) >= 0.0);
        let radial = surface.position_ws.normalize();
        smooth += usize::from((shading - radial).length() < 1e-2);
        bent += usize::from(radial.dot(wo) < 0.0);
    }
    assert!(smooth > 3000 && bent > 10, "{smooth} {bent}");
}

#[test]
fn normal_maps_tilt_along_the_coordinates() {
    let reference = TextureRef {
        texture: 0,
        uv_set: 0,
        columns: Mat2::IDENTITY,
        offset: Vec2::ZERO,
    };
    for tangents in [Vec::new(), vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4]] {
        // Red leans along +u (x here), green against v (up, y here).
        for (texel, expected) in [
            ([255, 128, 128, 255], Vec3::X),
            ([128, 255, 128, 255], Vec3::Y),
            ([128, 128, 255, 255], Vec3::Z),
        ] {
            let material = Material {
                normal_texture: Some(reference),
                ..Material::lambert("bumpy", Vec3::ONE)
            };
            let mut parts = parts(vec![material], &[Affine3A::IDENTITY]);
            parts.meshes[0].tangents = tangents.clone();
            let texture = Texture {
                name: "bumps".into(),
                width: 1,
                height: 1,
                texels: vec![texel].into(),
                srgb: false,
                wrap: Default::default(),
                nearest: false,
            };
            parts.textures = vec![texture];
            let scene = Scene::new(parts).unwrap();
            let eye = (expected + Vec3::Z * 0.2) * 3.0;
            let surface = see(&scene, eye, Vec3::new(0.2, 0.1, 0.0)).unwrap();
            assert!(
                surface.bsdf.normal_ws.dot(expected) > 0.99,
                "{texel:?}: {}",
                surface.bsdf.normal_ws
            );
        }
    }
}

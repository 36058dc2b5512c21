//! Every kernel against brute force in double precision.

use super::*;
use crate::Mesh;
use crate::{Instance, Material};
use glam::{Affine3A, DVec3, Mat3A, Quat};

/// A small generator for test geometry (SplitMix64).
struct Numbers(u64);

impl Numbers {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / 16_777_216.0
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    fn direction(&mut self) -> Vec3 {
        loop {
            let p = self.point();
            if (0.01..1.0).contains(&p.length_squared()) {
                return p.normalize();
            }
        }
    }
}

fn mesh_of(triangles: &[[Vec3; 3]]) -> Mesh {
    Mesh {
        positions: triangles.iter().flatten().copied().collect(),
        indices: (0..triangles.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        materials: vec![0; triangles.len()],
        ..Mesh::default()
    }
}

fn place(mesh: u32, world_from_local: Affine3A) -> Instance {
    Instance {
        mesh,
        origin: 0,
        world_from_local,
        local_from_world: world_from_local.inverse(),
        world_normal_from_local: Mat3A::IDENTITY,
        identity: world_from_local == Affine3A::IDENTITY,
    }
}

fn static_scene(triangles: &[[Vec3; 3]]) -> SceneParts {
    SceneParts {
        meshes: vec![mesh_of(triangles).into()],
        instances: vec![place(0, Affine3A::IDENTITY)],
        materials: vec![Material::lambert("", Vec3::ONE)],
        ..SceneParts::default()
    }
}

fn soup(numbers: &mut Numbers, count: usize, size: f32) -> Vec<[Vec3; 3]> {
    (0..count)
        .map(|_| {
            let center = numbers.point();
            [(); 3].map(|()| center + numbers.point() * size)
        })
        .collect()
}

/// All hits in (0, infinity) as (t, margin to the edges, id), margin relative to the triangle.
fn all_hits(parts: &SceneParts, ray: &Ray) -> Vec<(f64, f64, PrimitiveId)> {
    let (origin, direction) = (ray.origin_ws.as_dvec3(), ray.direction_ws.as_dvec3());
    let mut hits = Vec::new();
    for (instance, placement) in parts.instances.iter().enumerate() {
        let mesh = &parts.meshes[placement.mesh as usize];
        let world = |p: Vec3| -> DVec3 { placement.world_from_local.transform_point3(p).as_dvec3() };
        let mirrored = placement.world_from_local.matrix3.determinant() < 0.0;
        for triangle in 0..mesh.len() {
            let [a, b, c] = mesh.corners(triangle).map(world);
            let (e1, e2) = (b - a, c - a);
            let p = direction.cross(e2);
            let det = e1.dot(p);
            let front = (det > 0.0) != mirrored;
            let double_sided = parts.materials[mesh.materials[triangle] as usize].double_sided;
            if det == 0.0 || !front && !double_sided {
                continue;
            }
            let s = origin - a;
            let q = s.cross(e1);
            let (u, v, t) = (s.dot(p) / det, direction.dot(q) / det, e2.dot(q) / det);
            let margin = u.min(v).min(1.0 - u - v);
            if margin > -1e-3 && t > 0.0 {
                let id = PrimitiveId {
                    instance: instance as u32,
                    triangle: triangle as u32,
                };
                hits.push((t, margin, id));
            }
        }
    }
    hits.sort_by(|a, b| a.0.total_cmp(&b.0));
    hits
}

/// Whether each query's answer is one that brute force allows: a hit that is clear of edges must be found.
fn check(parts: &SceneParts, bvh: &Bvh, ray: &Ray, from: PrimitiveId, to: PrimitiveId, tolerance: f64) {
    let limit = f64::from(ray.t_max);
    let exact = all_hits(parts, ray);
    let near = |t: f64, other: f64| (t - other).abs() <= tolerance * (1.0 + t.abs());
    let sure = |hit: &&(f64, f64, PrimitiveId)| hit.1 > 1e-3 && hit.0 > tolerance && hit.0 < limit * (1.0 - 1e-5);
    {
        let nearest = bvh.nearest(parts, ray, from);
        let expected = exact.iter().filter(sure).find(|hit| hit.2 != from);
        if let Some(hit) = nearest {
            assert!(hit.t > 0.0 && hit.t < ray.t_max);
            assert!(hit.id != from);
            assert!(hit.u >= 0.0 && hit.v >= 0.0 && hit.u + hit.v <= 1.0 + 1e-6);
            let real = exact
                .iter()
                .find(|e| e.2 == hit.id)
                .expect("a hit is a hit of brute force as well");
            assert!(near(real.0, f64::from(hit.t)), "{} is not {}", hit.t, real.0);
            if let Some(expected) = expected {
                assert!(f64::from(hit.t) <= expected.0 || near(expected.0, f64::from(hit.t)));
            }
        } else {
            assert!(expected.is_none(), "missed {expected:?} of {ray:?}");
        }
        let occluded = bvh.occluded(parts, ray, from, to);
        let counts = |hit: &&(f64, f64, PrimitiveId)| hit.2 != from && hit.2 != to;
        if occluded {
            assert!(exact.iter().filter(counts).any(|hit| hit.0 < limit * (1.0 + 1e-5)));
        } else {
            assert!(!exact.iter().filter(sure).any(|hit| counts(&hit)));
        }
    }
}

fn random_ray(numbers: &mut Numbers) -> Ray {
    let t_max = if numbers.unit() < 0.5 {
        f32::INFINITY
    } else {
        numbers.unit() * 2.0
    };
    Ray {
        origin_ws: numbers.point() * 1.5,
        direction_ws: numbers.direction(),
        t_max,
    }
}

fn random_id(numbers: &mut Numbers, parts: &SceneParts) -> PrimitiveId {
    let instance = (numbers.unit() * parts.instances.len() as f32) as u32;
    let count = parts.meshes[parts.instances[instance as usize].mesh as usize].len();
    PrimitiveId {
        instance,
        triangle: (numbers.unit() * count as f32) as u32,
    }
}

fn check_random(parts: &SceneParts, numbers: &mut Numbers, rays: usize) {
    let mut bvh = Bvh::build(parts);
    let kernels = Kernel::available();
    for i in 0..rays {
        bvh.set_kernel(kernels[i % kernels.len()]);
        let ray = random_ray(numbers);
        let (from, to) = (random_id(numbers, parts), random_id(numbers, parts));
        check(parts, &bvh, &ray, from, to, 1e-4);
        let first = bvh.nearest(parts, &ray, from).map_or(from, |hit| hit.id);
        check(parts, &bvh, &ray, first, to, 1e-4);
        check(parts, &bvh, &ray, from, first, 1e-4);
    }
}

#[test]
fn soups_agree_with_brute_force() {
    let mut numbers = Numbers(1);
    for (count, size) in [(1, 1.0), (2, 1.0), (9, 1.0), (30, 0.5), (300, 0.3), (3_000, 0.1)] {
        let triangles = soup(&mut numbers, count, size);
        check_random(&static_scene(&triangles), &mut numbers, 300);
    }
}

/// Whether each ray of a packet gets a hit that a single ray may get too: the same one, up to rounding at edges.
fn check_packet(parts: &SceneParts, bvh: &Bvh, packet: &Packet, tolerance: f32) -> (u32, u32) {
    let (mut met, mut differ) = (0, 0);
    let hits = bvh.nearest_of_packet(parts, packet);
    for (i, hit) in hits.iter().enumerate() {
        let ray = Ray {
            origin_ws: packet.origin_ws,
            direction_ws: packet.direction_ws(i),
            t_max: f32::INFINITY,
        };
        let alone = bvh.nearest(parts, &ray, PrimitiveId::NONE);
        met += u32::from(alone.is_some());
        let same = match (hit, alone) {
            (Some(a), Some(b)) => {
                a.id == b.id && (a.t - b.t).abs() <= tolerance * b.t && (a.u - b.u).abs() + (a.v - b.v).abs() < 1e-2
            }
            (a, b) => a.is_none() && b.is_none(),
        };
        differ += u32::from(!same);
    }
    (met, differ)
}

#[test]
fn packets_agree_with_single_rays() {
    let mut numbers = Numbers(11);
    let mut instanced = static_scene(&soup(&mut numbers, 300, 0.4));
    instanced.meshes.push(mesh_of(&soup(&mut numbers, 50, 0.3)).into());
    let turned = Affine3A::from_rotation_translation(Quat::from_rotation_x(1.0), Vec3::new(0.5, 0.0, -0.5));
    instanced.instances.push(place(1, turned));
    for parts in [static_scene(&soup(&mut numbers, 1000, 0.3)), instanced] {
        let mut bvh = Bvh::build(&parts);
        for kernel in Kernel::available() {
            bvh.set_kernel(kernel);
            let (mut met, mut differ) = (0, 0);
            for i in 0..400 {
                // From narrow bundles to rays all over the place, along axes too.
                let spread = [1e-6, 1e-3, 0.1, 2.0][i % 4];
                let mut middle = numbers.direction();
                if i % 3 == 0 {
                    middle = middle.normalize().round().try_normalize().unwrap_or(Vec3::X);
                }
                let mut packet = Packet {
                    origin_ws: numbers.point() * 1.5,
                    directions_ws: [[0.0; PACKET]; 3],
                };
                for ray in 0..PACKET {
                    let along = if ray == 3 && i % 3 == 0 {
                        Vec3::ZERO
                    } else {
                        numbers.point()
                    };
                    let direction = (middle + along * spread).normalize_or(Vec3::X);
                    (0..3).for_each(|axis| packet.directions_ws[axis][ray] = direction[axis]);
                }
                let (m, d) = check_packet(&parts, &bvh, &packet, 1e-4);
                (met, differ) = (met + m, differ + d);
            }
            assert!(met > 1000, "only {met} rays meet anything");
            // Rays that pass within rounding of an edge may fall on either side of it.
            assert!(differ <= 4, "{differ} of {met} hits differ ({})", kernel.name());
        }
    }
}

#[test]
fn packets_do_not_leak_through_closed_meshes() {
    // A fine sphere around the origin: whatever the direction, there is a triangle there, as far as the radius.
    let mut numbers = Numbers(12);
    let at = |i: u32, j: u32| {
        let (polar, around) = (
            std::f32::consts::PI * i as f32 / 24.0,
            std::f32::consts::TAU * (j % 48) as f32 / 48.0,
        );
        if i == 24 {
            Vec3::NEG_Z
        } else {
            Vec3::new(polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos())
        }
    };
    let mut triangles = Vec::new();
    for i in 0..24 {
        for j in 0..48 {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    let mut parts = static_scene(&triangles);
    parts.materials[0].double_sided = true;
    let mut bvh = Bvh::build(&parts);
    for kernel in Kernel::available() {
        bvh.set_kernel(kernel);
        for _ in 0..2000 {
            // Towards corners and points on edges, where cracks would be.
            let [a, b, _] = triangles[(numbers.unit() * triangles.len() as f32) as usize];
            let mut packet = Packet {
                origin_ws: Vec3::ZERO,
                directions_ws: [[0.0; PACKET]; 3],
            };
            for ray in 0..PACKET {
                let direction = a.lerp(b, ray as f32 / 7.0).normalize();
                (0..3).for_each(|axis| packet.directions_ws[axis][ray] = direction[axis]);
            }
            for hit in bvh.nearest_of_packet(&parts, &packet) {
                let hit = hit.expect("the sphere is closed");
                assert!((0.98..1.001).contains(&hit.t), "{}", hit.t);
            }
        }
    }
}

#[test]
fn one_sided_triangles_have_no_back() {
    let mut numbers = Numbers(2);
    let mut parts = static_scene(&soup(&mut numbers, 300, 0.4));
    parts.materials.push(Material::emitter("", Vec3::ONE));
    for (i, material) in parts.meshes[0].materials.iter_mut().enumerate() {
        *material = i as u32 % 2;
    }
    check_random(&parts, &mut numbers, 1_000);
}

#[test]
fn instances_agree_with_brute_force() {
    let mut numbers = Numbers(3);
    for with_fixed in [true, false] {
        let mut parts = static_scene(&soup(&mut numbers, if with_fixed { 50 } else { 0 }, 0.3));
        parts.materials.push(Material::emitter("", Vec3::ONE));
        for count in [7, 40] {
            let mut mesh = mesh_of(&soup(&mut numbers, count, 0.5));
            mesh.materials.iter_mut().step_by(2).for_each(|material| *material = 1);
            parts.meshes.push(mesh.into());
        }
        for i in 0..20 {
            let size = Vec3::new(numbers.unit() + 0.1, numbers.unit() + 0.1, numbers.unit() + 0.1) * 0.3;
            let mirror = if i % 3 == 0 {
                Vec3::new(-1.0, 1.0, 1.0)
            } else {
                Vec3::ONE
            };
            let axis = numbers.direction();
            let transform = Affine3A::from_scale_rotation_translation(
                size * mirror,
                Quat::from_axis_angle(axis, numbers.unit() * 6.0),
                numbers.point(),
            );
            parts.instances.push(place(1 + i % 2, transform));
        }
        check_random(&parts, &mut numbers, 1_000);
    }
}

#[test]
fn empty_and_degenerate_scenes_are_never_hit() {
    let p = Vec3::new(0.5, 0.25, 0.125);
    let mut numbers = Numbers(4);
    for triangles in [vec![], vec![[p; 3]; 20], vec![[p, p * 2.0, p * 3.0]; 20]] {
        let parts = static_scene(&triangles);
        let bvh = Bvh::build(&parts);
        for _ in 0..100 {
            let origin_ws = numbers.point();
            let ray = Ray {
                origin_ws,
                direction_ws: (p - origin_ws).normalize(),
                t_max: f32::INFINITY,
            };
            assert!(bvh.nearest(&parts, &ray, PrimitiveId::NONE).is_none());
            assert!(!bvh.occluded(&parts, &ray, PrimitiveId::NONE, PrimitiveId::NONE));
        }
    }
}

/// Every ray from inside a closed mesh must hit it, those through edges and corners too.
#[test]
fn closed_meshes_do_not_leak() {
    let mut numbers = Numbers(5);
    let (columns, rows) = (64u32, 32u32);
    let point = |column: u32, row: u32| {
        let theta = std::f32::consts::PI * row as f32 / rows as f32;
        let phi = std::f32::consts::TAU * (column % columns) as f32 / columns as f32;
        let around = if row == 0 || row == rows { 0.0 } else { theta.sin() };
        Vec3::new(around * phi.cos(), theta.cos(), around * phi.sin())
    };
    let mut sphere = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| point(column + i, row + j));
            sphere.extend([[a, b, c], [a, c, d]]);
        }
    }
    let corner = |i: usize| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32) * 2.0 - 1.0;
    let mut cube = Vec::new();
    for [a, b, c, d] in [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ] {
        let [a, b, c, d] = [a, b, c, d].map(corner);
        cube.extend([[a, b, c], [a, c, d]]);
    }
    for (mesh, scale, rays) in [(&sphere, 1.0, 200_000), (&cube, 1e-4, 100_000), (&cube, 1e5, 100_000)] {
        let offset = Vec3::new(0.3, 5.0, -0.7) * scale;
        let moved: Vec<_> = mesh.iter().map(|t| t.map(|p| p * scale + offset)).collect();
        let parts = static_scene(&moved);
        let mut bvh = Bvh::build(&parts);
        for kernel in Kernel::available() {
            bvh.set_kernel(kernel);
            for i in 0..rays {
                let origin_ws = numbers.point() * (0.5 * scale) + offset;
                // Every second ray goes through a corner or a point on an edge.
                let direction_ws = if i % 2 == 0 {
                    numbers.direction()
                } else {
                    let triangle = moved[(numbers.unit() * moved.len() as f32) as usize];
                    let along = if i % 4 == 1 { 0.0 } else { numbers.unit() };
                    (triangle[0] + (triangle[1] - triangle[0]) * along - origin_ws).normalize()
                };
                let ray = Ray {
                    origin_ws,
                    direction_ws,
                    t_max: f32::INFINITY,
                };
                let none = PrimitiveId::NONE;
                assert!(bvh.nearest(&parts, &ray, none).is_some(), "{kernel:?} leaks {ray:?}");
                assert!(bvh.occluded(&parts, &ray, none, none), "{kernel:?} leaks {ray:?}");
            }
        }
    }
}

#[test]
fn axis_aligned_rays_hit_axis_aligned_walls() {
    for scale in [1e-4f32, 1.0, 1e5] {
        let wall = |x: f32| {
            let [a, b, c, d] =
                [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(y, z)| Vec3::new(x, y, z) * scale);
            [[a, b, c], [a, c, d]]
        };
        // The wall at 2 is there twice, coplanar.
        let parts = static_scene(&[wall(1.0), wall(2.0), wall(2.0)].concat());
        let mut bvh = Bvh::build(&parts);
        for kernel in Kernel::available() {
            bvh.set_kernel(kernel);
            for (y, z) in [(0.0, 0.0), (0.5, 0.5), (1.0, 0.25), (-1.0, -1.0), (-0.25, 0.75)] {
                let none = PrimitiveId::NONE;
                let ray = |x: f32, sign: f32, t_max: f32| Ray {
                    origin_ws: Vec3::new(x, y, z) * scale,
                    direction_ws: Vec3::new(sign, -0.0, 0.0),
                    t_max: t_max * scale,
                };
                let t = |ray: &Ray| bvh.nearest(&parts, ray, none).map(|hit| hit.t / scale);
                let close = |t: Option<f32>, to: f32| t.is_some_and(|t| (t - to).abs() < 1e-5);
                assert!(close(t(&ray(0.0, 1.0, f32::INFINITY)), 1.0));
                assert!(close(t(&ray(3.0, -1.0, f32::INFINITY)), 1.0));
                assert!(close(t(&ray(1.5, 1.0, 10.0)), 0.5));
                assert!(t(&ray(0.0, 1.0, 0.99)).is_none());
                assert!(t(&ray(0.0, -1.0, f32::INFINITY)).is_none());
                assert!(!bvh.occluded(&parts, &ray(0.0, 1.0, 0.99), none, none));
                assert!(bvh.occluded(&parts, &ray(0.0, 1.0, 1.01), none, none));
            }
        }
    }
}

#[test]
fn alpha_below_the_cutoff_is_not_there() {
    let mut numbers = Numbers(6);
    let mut parts = static_scene(&soup(&mut numbers, 800, 0.4));
    let mut cut_out = Material::lambert("", Vec3::ONE);
    cut_out.alpha_cutoff = Some(0.5);
    parts.materials.push(cut_out);
    parts.meshes[0]
        .materials
        .iter_mut()
        .step_by(2)
        .for_each(|material| *material = 1);
    // The vertex alpha runs from 1 at the first corner to 0 at the others.
    let alpha = (0..2_400).map(|i| glam::Vec4::new(1.0, 1.0, 1.0, if i % 3 == 0 { 1.0 } else { 0.0 }));
    parts.meshes[0].colors = alpha.collect();
    let mut bvh = Bvh::build(&parts);
    let (mut through, none) = (0, PrimitiveId::NONE);
    for i in 0..2_000 {
        let kernels = Kernel::available();
        bvh.set_kernel(kernels[i % kernels.len()]);
        let ray = Ray {
            t_max: f32::INFINITY,
            ..random_ray(&mut numbers)
        };
        let exact = all_hits(&parts, &ray);
        let Some(hit) = bvh.nearest(&parts, &ray, none) else {
            assert!(exact.iter().all(|e| e.2.triangle % 2 == 0 || e.1 < 1e-3));
            continue;
        };
        assert!(hit.id.triangle % 2 == 1 || 1.0 - hit.u - hit.v >= 0.5);
        let before = |e: &&(f64, f64, PrimitiveId)| e.0 < f64::from(hit.t) * (1.0 - 1e-4) && e.1 > 1e-3;
        assert!(exact.iter().filter(before).all(|e| e.2.triangle % 2 == 0));
        through += usize::from(exact.iter().any(|e| before(&e)));
        let short = Ray {
            t_max: hit.t * 0.999,
            ..ray
        };
        assert!(!bvh.occluded(&parts, &short, none, none));
    }
    assert!(through > 100, "{through}");
}

/// Sizes that grow by a factor make the deepest trees; coincident and huge triangles the worst clusters.
#[test]
fn awkward_geometry_builds_and_is_hit() {
    let triangle = |size: f32| {
        [
            Vec3::new(-1.0, -1.0, 1.0),
            Vec3::new(1.0, -1.0, 1.0),
            Vec3::new(0.0, 1.0, 1.0),
        ]
        .map(|p| p * size)
    };
    let nested: Vec<_> = (0..200).map(|i| triangle(1.3f32.powi(i - 100))).collect();
    let coincident = vec![triangle(1.0); 5_000];
    let huge = vec![triangle(1e12), triangle(1.0), triangle(1e-12)];
    for triangles in [nested, coincident, huge] {
        let nearest = triangles.iter().map(|t| t[0].z).fold(f32::INFINITY, f32::min);
        let parts = static_scene(&triangles);
        let mut bvh = Bvh::build(&parts);
        for kernel in Kernel::available() {
            bvh.set_kernel(kernel);
            let ray = Ray {
                origin_ws: Vec3::ZERO,
                direction_ws: Vec3::Z,
                t_max: f32::INFINITY,
            };
            let hit = bvh
                .nearest(&parts, &ray, PrimitiveId::NONE)
                .expect("all of them lie ahead");
            assert!((hit.t - nearest).abs() <= 1e-6 * nearest);
        }
    }
}

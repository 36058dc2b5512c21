//! Deterministic test scenes in about the unit cube.

use glam::{Affine3A, Mat3A, Vec3};
use scene::{Instance, Material, Mesh, SceneParts};
use std::f32::consts::{PI, TAU};

/// SplitMix64.
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    pub(crate) fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / 16_777_216.0
    }

    /// Uniform on the unit sphere.
    pub(crate) fn direction(&mut self) -> Vec3 {
        let z = 1.0 - 2.0 * self.unit();
        let phi = TAU * self.unit();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    }
}

type Triangles = Vec<[Vec3; 3]>;

/// `box`: 30 triangles; `rooms`: 30 thousand; `bumps`: a million.
pub(crate) fn build_parts(name: &str) -> Option<SceneParts> {
    let triangles = match name {
        "box" => small_box(),
        "rooms" => rooms(),
        "bumps" => bumps(),
        _ => return None,
    };
    let mesh = Mesh {
        positions: triangles.iter().flatten().copied().collect(),
        indices: (0..triangles.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        materials: vec![0; triangles.len()],
        ..Mesh::default()
    };
    Some(SceneParts {
        name: name.into(),
        meshes: vec![mesh.into()],
        instances: vec![Instance {
            mesh: 0,
            origin: 0,
            world_from_local: Affine3A::IDENTITY,
            local_from_world: Affine3A::IDENTITY,
            world_normal_from_local: Mat3A::IDENTITY,
            identity: true,
        }],
        materials: vec![Material::lambert("grey", Vec3::splat(0.5))],
        ..SceneParts::default()
    })
}

/// Two triangles.
fn quad(out: &mut Triangles, a: Vec3, b: Vec3, c: Vec3, d: Vec3) {
    out.extend([[a, b, c], [a, c, d]]);
}

/// Twelve triangles around a box, turned about the y axis.
fn block(out: &mut Triangles, center: Vec3, half: Vec3, angle: f32) {
    let (sin, cos) = angle.sin_cos();
    let corner = |i: usize| {
        let sign = |bit: usize| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
        let p = half * Vec3::new(sign(0), sign(1), sign(2));
        center + Vec3::new(cos * p.x + sin * p.z, p.y, cos * p.z - sin * p.x)
    };
    for [a, b, c, d] in [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ] {
        quad(out, corner(a), corner(b), corner(c), corner(d));
    }
}

/// `2 * columns * (rows - 1)` triangles around `center`, `radius` by direction.
fn ball(out: &mut Triangles, center: Vec3, columns: usize, rows: usize, radius: impl Fn(Vec3) -> f32) {
    let point = |column: usize, row: usize| {
        let (theta, phi) = (
            PI * row as f32 / rows as f32,
            TAU * (column % columns) as f32 / columns as f32,
        );
        let up = if row == rows { -1.0 } else { theta.cos() };
        let around = if row == 0 || row == rows { 0.0 } else { theta.sin() };
        let d = Vec3::new(around * phi.cos(), up, around * phi.sin());
        center + d * radius(d)
    };
    for row in 0..rows {
        for column in 0..columns {
            let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(right, down)| point(column + right, row + down));
            if row > 0 {
                out.push([a, b, c]);
            }
            if row + 1 < rows {
                out.push([a, c, d]);
            }
        }
    }
}

fn small_box() -> Triangles {
    let mut out = Vec::new();
    block(&mut out, Vec3::splat(0.5), Vec3::splat(0.5), 0.0);
    block(&mut out, Vec3::new(0.35, 0.2, 0.7), Vec3::new(0.12, 0.2, 0.12), 0.3);
    let lamp = |x: f32, z: f32| Vec3::new(x, 0.99, z);
    for x in [0.2, 0.5, 0.8] {
        quad(
            &mut out,
            lamp(x, 0.4),
            lamp(x, 0.6),
            lamp(x + 0.1, 0.6),
            lamp(x + 0.1, 0.4),
        );
    }
    out
}

/// A grid of rooms with doors, each with furniture made of blocks and balls.
fn rooms() -> Triangles {
    let mut numbers = Numbers(11);
    let mut out = Vec::new();
    block(&mut out, Vec3::splat(0.5), Vec3::splat(0.5), 0.0);
    let count = 5;
    let size = 1.0 / count as f32;
    for i in 1..count {
        for j in 0..count {
            let (wall, along) = (i as f32 * size, (j as f32 + 0.5) * size);
            let length = size * 0.35;
            for side in [-0.325, 0.325] {
                let z = along + side * size;
                block(
                    &mut out,
                    Vec3::new(wall, 0.5, z),
                    Vec3::new(0.004, 0.5, length * 0.5),
                    0.0,
                );
                block(
                    &mut out,
                    Vec3::new(z, 0.5, wall),
                    Vec3::new(length * 0.5, 0.5, 0.004),
                    0.0,
                );
            }
        }
    }
    for i in 0..count * count {
        let corner = Vec3::new((i % count) as f32, 0.0, (i / count) as f32) * size;
        for piece in 0..9 {
            let at = corner + Vec3::new(numbers.unit() * 0.7 + 0.15, 0.0, numbers.unit() * 0.7 + 0.15) * size;
            let half = Vec3::new(numbers.unit() + 0.2, numbers.unit() * 3.0 + 0.5, numbers.unit() + 0.2) * size * 0.08;
            if piece % 2 == 0 {
                for part in 0..6 {
                    let up = Vec3::Y * half.y * (2 * part + 1) as f32;
                    block(
                        &mut out,
                        at + up,
                        half * (1.0 - 0.12 * part as f32),
                        numbers.unit() * 3.0,
                    );
                }
            } else {
                let radius = half.x;
                ball(&mut out, at + Vec3::Y * (0.1 + numbers.unit() * 0.6), 16, 9, |_| radius);
            }
        }
    }
    out
}

/// A bumpy ball of 400 thousand triangles in a room full of 2,500 small ones.
fn bumps() -> Triangles {
    let mut numbers = Numbers(13);
    let mut out = Vec::with_capacity(1_010_000);
    block(&mut out, Vec3::splat(0.5), Vec3::splat(0.5), 0.0);
    let wave = |d: Vec3| (d.x * 40.0).sin() * (d.y * 43.0).sin() * (d.z * 37.0).sin();
    ball(&mut out, Vec3::new(0.5, 0.45, 0.55), 640, 314, |d| {
        0.25 + 0.02 * wave(d) + 0.002 * wave(d * 7.0)
    });
    for _ in 0..2_500 {
        let center = Vec3::new(numbers.unit(), numbers.unit(), numbers.unit()) * 0.94 + 0.03;
        let radius = 0.004 + 0.02 * numbers.unit().powi(3);
        let phase = numbers.direction() * 5.0;
        ball(&mut out, center, 15, 9, |d| radius * (1.0 + 0.3 * (d.dot(phase)).sin()));
    }
    out
}

//! A camera for a file that has none.

use super::bounds::Bounds;
use crate::{Camera, Mesh, SceneParts};
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Triangles tested per ray at most: the view of a made-up camera is not worth more.
const MAX_TRIANGLES: usize = 2_000_000;
/// Directions around the centre that decide whether the scene is an interior.
const PROBES: usize = 64;
/// Directions among which the longest way through a room is sought.
const HEADINGS: usize = 16;

/// A camera that frames the scene, and in words where it stands.
///
/// An interior is entered: if most rays from the centre meet the front of a surface (walls that face inwards; the inside
/// of a closed object shows backs), the camera stands in the middle of the room, at one end of the longest free way
/// through it. Anything else is seen whole, from the front, the right and above.
pub(super) fn camera(parts: &SceneParts, bounds: &Bounds) -> (Camera, &'static str) {
    let center = bounds.center();
    let radius = bounds.radius().max(1e-3);
    let probes: Vec<Vec3> = (0..PROBES).map(spiral).collect();
    let inside = probe(parts, center, &probes).iter().filter(|hit| hit.front).count();
    if inside * 4 > PROBES * 3 {
        return (interior(parts, center, radius), "through the room from within");
    }
    let fov_y = PI / 4.0;
    let direction = Vec3::new(0.55, 0.4, 1.0).normalize();
    let distance = radius / (0.5 * fov_y).sin();
    let camera = Camera::look_at("framing", center + direction * distance, center, Vec3::Y, fov_y);
    (camera, "at the whole scene from outside")
}

/// Point `i` of a spherical Fibonacci set of [`PROBES`] directions.
fn spiral(i: usize) -> Vec3 {
    let golden = 0.618_034;
    let z = 1.0 - (2.0 * i as f32 + 1.0) / PROBES as f32;
    let angle = TAU * (i as f32 * golden).fract();
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * angle.cos(), z, r * angle.sin())
}

fn interior(parts: &SceneParts, center: Vec3, radius: f32) -> Camera {
    let headings: Vec<Vec3> = (0..HEADINGS)
        .map(|i| {
            let (sin, cos) = (TAU * (i as f32 + 0.5) / HEADINGS as f32).sin_cos();
            Vec3::new(cos, 0.0, sin)
        })
        .collect();
    let free: Vec<f32> = probe(parts, center, &headings)
        .iter()
        .map(|hit| hit.t.min(radius))
        .collect();
    let behind = |i: usize| free[(i + HEADINGS / 2) % HEADINGS];
    let way = |i: usize| free[i] + behind(i);
    let best = (1..HEADINGS).fold(0, |best, i| if way(i) > way(best) { i } else { best });
    let eye = center - headings[best] * 0.85 * behind(best);
    let target = center + headings[best] * free[best] - Vec3::Y * 0.1 * way(best);
    Camera::look_at("framing", eye, target, Vec3::Y, PI / 3.0)
}

#[derive(Clone, Copy)]
struct Probe {
    t: f32,
    front: bool,
}

/// Nearest hits from `origin`, by trying all triangles: this runs once, before there is an acceleration structure.
fn probe(parts: &SceneParts, origin: Vec3, directions: &[Vec3]) -> Vec<Probe> {
    let mut nearest = vec![
        Probe {
            t: f32::INFINITY,
            front: false
        };
        directions.len()
    ];
    let mut left = MAX_TRIANGLES;
    for instance in &parts.instances {
        if left == 0 {
            break;
        }
        let mesh: &Mesh = &parts.meshes[instance.mesh as usize];
        let mirrored = instance.world_from_local.matrix3.determinant() < 0.0;
        for i in 0..mesh.len().min(left) {
            let corners = mesh
                .corners(i)
                .map(|p| instance.world_from_local.transform_point3(p) - origin);
            for (hit, &direction) in nearest.iter_mut().zip(directions) {
                if let Some((t, back)) = intersect(corners, direction)
                    && t < hit.t
                {
                    *hit = Probe {
                        t,
                        front: back == mirrored,
                    };
                }
            }
        }
        left = left.saturating_sub(mesh.len());
    }
    nearest
}

/// Moeller and Trumbore 1997: distance, and whether the back is seen.
fn intersect([a, b, c]: [Vec3; 3], direction: Vec3) -> Option<(f32, bool)> {
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    let q = (-a).cross(e1);
    let uv = Vec2::new((-a).dot(p), direction.dot(q)) / determinant;
    let t = e2.dot(q) / determinant;
    let hit = uv.x >= 0.0 && uv.y >= 0.0 && uv.x + uv.y <= 1.0 && t > 0.0;
    hit.then_some((t, determinant < 0.0))
}

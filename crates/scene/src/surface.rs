//! What a ray found, resolved: the surface point that shading works on.

use crate::inputs::{CORNERS, Inputs, interpolate};
use crate::shading::{Lobes, NO_EMITTER, TriangleRecord};
use crate::{Bsdf, Hit, Material, Mesh, PrimitiveId, Ray, Scene};
use glam::{Vec2, Vec3, Vec4};

/// Marks a triangle that is no light.
pub const NO_LIGHT: u32 = u32::MAX;

/// A surface point, seen along `-wo_ws`.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// World position, on the triangle (more exact than origin + t direction).
    pub position_ws: Vec3,
    /// Unit geometric normal on the viewer's side. Light whose direction has a cosine of 0 or less with it cannot arrive,
    /// whatever the shading normal says: integrators must test this, or light leaks through smooth surfaces.
    pub geometric_normal_ws: Vec3,
    /// Towards where the ray came from, as far as that lies within the surface: shorter than 1.
    pub back_ws: Vec3,
    /// The triangle: rays that leave pass it to be skipped.
    pub id: PrimitiveId,
    /// Index of the material.
    pub material: u32,
    /// Texture coordinates (set 0); zero where neither textures nor vertex colours take part.
    pub uv: Vec2,
    /// Index of the light this triangle is, or [`NO_LIGHT`].
    pub light: u32,
    /// Radiance emitted towards the viewer: zero for no light, or seen from a side that does not emit. May be positive
    /// where `light` is [`NO_LIGHT`]: a triangle too small to be drawn as a light.
    pub emitted: Vec3,
    /// The material here. Its normal is the shading normal, with a positive cosine both to the viewer and to the
    /// geometric normal.
    pub bsdf: Bsdf,
}

impl Scene {
    /// Everything shading needs to know about a hit.
    #[inline(always)]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let placement = &self.shading.placements[hit.id.instance as usize];
        let triangle = match placement.fixed {
            true => &self.shading.fixed[hit.id.triangle as usize],
            false => self.placed_record(placement.mesh, hit.id.triangle),
        };
        let (position_ws, normal_ws) = if placement.fixed {
            // Pulled on to the plane: as exact across the surface as interpolation of the corners, without reading them.
            // What error remains lies within the plane: rays that leave are kept from doing harm there, see [`Scene::ray_from`].
            let along = ray.origin_ws + ray.direction_ws * hit.t;
            let off = triangle.normal.dot(along) - triangle.plane;
            (along - triangle.normal * off, triangle.normal)
        } else {
            self.placed(hit, triangle)
        };
        let facing = normal_ws.dot(ray.direction_ws);
        let front = facing <= 0.0;
        let geometric_normal_ws = if front { normal_ws } else { -normal_ws };
        let material = &self.shading.materials[triangle.material() as usize];
        let light = match triangle.emitter {
            NO_EMITTER => NO_LIGHT,
            emitter => self.shading.lights[(placement.first_emitter + emitter) as usize],
        };
        let emits = front || material.double_sided;
        let surface = Surface {
            position_ws,
            geometric_normal_ws,
            back_ws: normal_ws * facing - ray.direction_ws,
            id: hit.id,
            material: triangle.material(),
            uv: Vec2::ZERO,
            light,
            emitted: if emits { material.emission } else { Vec3::ZERO },
            bsdf: Bsdf {
                normal_ws: geometric_normal_ws,
                diffuse: material.diffuse,
                f0: material.f0,
                f90: material.f90,
                alpha: material.alpha,
            },
        };
        if triangle.plain() {
            surface
        } else {
            // A copy: only what `refine` is given must lie in memory, and the rest stays in registers.
            let mut refined = surface;
            self.refine(&mut refined, triangle, ray, hit);
            refined
        }
    }

    /// The record of a triangle that is not in world space.
    #[cold]
    #[inline(never)]
    fn placed_record(&self, mesh: u32, triangle: u32) -> &TriangleRecord {
        &self.shading.records(&self.parts, mesh)[triangle as usize]
    }

    /// World position and front normal of a hit on an instance that is not where its mesh is.
    #[cold]
    #[inline(never)]
    fn placed(&self, hit: &Hit, triangle: &TriangleRecord) -> (Vec3, Vec3) {
        let instance = &self.parts.instances[hit.id.instance as usize];
        let corners = self.parts.meshes[instance.mesh as usize].corners(hit.id.triangle as usize);
        let local = interpolate(corners, hit.u, hit.v);
        let normal = instance.world_normal_from_local * triangle.normal;
        (instance.world_from_local.transform_point3(local), normal.normalize())
    }

    /// Interpolated normals, textures and vertex colours.
    #[cold]
    #[inline(never)]
    fn refine(&self, surface: &mut Surface, triangle: &TriangleRecord, ray: &Ray, hit: &Hit) {
        let instance = &self.parts.instances[hit.id.instance as usize];
        let mesh = &self.parts.meshes[instance.mesh as usize];
        let material = &self.parts.materials[triangle.material() as usize];
        let mut normal = triangle.normal;
        if triangle.smooth() {
            let vertices = mesh.indices[hit.id.triangle as usize];
            let smooth = interpolate(vertices.map(|v| mesh.normals[v as usize]), hit.u, hit.v);
            normal = smooth.try_normalize().unwrap_or(normal);
        }
        if triangle.detailed() {
            let inputs = Inputs::at(mesh, hit.id.triangle as usize, hit.u, hit.v);
            let map = material.normal_texture.as_ref();
            if let Some(texel) = map.and_then(|reference| inputs.texel(&self.parts.textures, reference)) {
                normal = mapped_normal(mesh, material, hit, normal, texel);
            }
            let base_color = inputs.base_color(&self.parts.textures, material).truncate();
            let [metallic, roughness] = inputs.metallic_roughness(&self.parts.textures, material).to_array();
            let lobes = Lobes::new(material, base_color, metallic, roughness);
            surface.uv = inputs.uvs[0].unwrap_or_default();
            surface.bsdf.diffuse = lobes.diffuse;
            surface.bsdf.f0 = lobes.f0;
            surface.bsdf.f90 = lobes.f90;
            surface.bsdf.alpha = lobes.alpha;
            if surface.emitted != Vec3::ZERO {
                surface.emitted = inputs.emission(&self.parts.textures, material);
            }
        }
        let normal_ws = if instance.identity {
            normal
        } else {
            instance.world_normal_from_local * normal
        };
        surface.bsdf.normal_ws = usable_normal(normal_ws, surface.geometric_normal_ws, -ray.direction_ws);
    }

    /// A ray that leaves `surface` towards `wi_ws`, its origin moved off the surface on the side of `wi_ws`.
    ///
    /// The length is 128 units in the last place of the largest coordinate, well above the error of `position_ws` (after
    /// Waechter and Binder, Ray Tracing Gems 2019, chapter 6). Differs: one length for all coordinates, and near the
    /// origin a share of the scene's radius instead of a constant in metres, so that a scaled scene gives the same image. And as far
    /// within the surface, back the way the ray came that met it: next to an edge rounding may have carried the point across the plane of the
    /// neighbouring triangle, from where rays would leave a closed room; the way that the ray came was free.
    #[inline]
    pub fn ray_from(&self, surface: &Surface, wi_ws: Vec3, t_max: f32) -> Ray {
        Ray {
            origin_ws: surface.position_ws + self.off_surface(surface, wi_ws),
            direction_ws: wi_ws,
            t_max,
        }
    }

    /// A ray that leaves `surface` as [`Scene::ray_from`] does and ends short of the point at `distance` along `wi_ws`, to which it is
    /// aimed from where it starts: one that kept its direction would pass beside the point by as much as its origin was moved, and
    /// could be stopped by what lies next to the light. Its direction is a unit vector to within that shift.
    #[inline]
    pub fn shadow_ray(&self, surface: &Surface, wi_ws: Vec3, distance: f32) -> Ray {
        // Short of the light by more than the error of where it is hit: the surface around an emitter lies in its plane.
        const END: f32 = 1.0 - 1.0 / 262_144.0;
        let moved = self.off_surface(surface, wi_ws);
        // And by as much as it was moved off the surface here, for the same reason: near by, errors are no share of the distance.
        Ray {
            origin_ws: surface.position_ws + moved,
            direction_ws: wi_ws - moved / distance,
            t_max: (distance * END - moved.length()).max(0.0),
        }
    }

    /// From a surface point to where a ray towards `wi_ws` starts, see [`Scene::ray_from`].
    #[inline]
    fn off_surface(&self, surface: &Surface, wi_ws: Vec3) -> Vec3 {
        const UNITS: f32 = 1.0 / 65_536.0;
        // Eight units in the last place of the radius: the distance to a large triangle, met across an edge that it shares with this one, is no
        // better known than that.
        const NEAR_ORIGIN: f32 = 1.0 / 32.0;
        let largest = surface.position_ws.abs().max_element().max(self.radius * NEAR_ORIGIN);
        let length = UNITS * largest;
        let side = length.copysign(wi_ws.dot(surface.geometric_normal_ws));
        surface.geometric_normal_ws * side + surface.back_ws * length
    }
}

/// A shading normal that can be used with this viewer: on the side of the geometric normal, and never facing away
/// from the viewer, which would make closed surfaces black along their silhouettes. Where it would face away it is
/// bent just far enough, so that shading stays continuous.
fn usable_normal(shading: Vec3, geometric: Vec3, wo: Vec3) -> Vec3 {
    const LEAST_COSINE: f32 = 1e-3;
    let Some(shading) = shading.try_normalize() else {
        return geometric;
    };
    let shading = if shading.dot(geometric) < 0.0 {
        -shading
    } else {
        shading
    };
    let cosine = shading.dot(wo);
    if cosine >= LEAST_COSINE {
        return shading;
    }
    // Adding wo, which is on the side of the geometric normal, cannot leave that side.
    let bent = shading + wo * (LEAST_COSINE - cosine);
    bent.try_normalize().unwrap_or(geometric)
}

/// The shading normal of a normal-mapped point (glTF 2.0 section 3.9.3), local space.
fn mapped_normal(mesh: &Mesh, material: &Material, hit: &Hit, normal: Vec3, texel: Vec4) -> Vec3 {
    let triangle = hit.id.triangle as usize;
    let Some((tangent, handedness)) = tangent(mesh, triangle, hit).or_else(|| uv_tangent(mesh, material, triangle))
    else {
        return normal;
    };
    let Some(x) = (tangent - normal * normal.dot(tangent)).try_normalize() else {
        return normal;
    };
    let y = normal.cross(x) * handedness;
    let mapped = texel.truncate() * 2.0 - 1.0;
    let scaled = x * (mapped.x * material.normal_scale) + y * (mapped.y * material.normal_scale) + normal * mapped.z;
    scaled.try_normalize().unwrap_or(normal)
}

/// Interpolated tangent and handedness from the mesh.
fn tangent(mesh: &Mesh, triangle: usize, hit: &Hit) -> Option<(Vec3, f32)> {
    if mesh.tangents.is_empty() {
        return None;
    }
    let tangents = mesh.indices[triangle].map(|v| mesh.tangents[v as usize]);
    let direction = interpolate(tangents.map(Vec4::truncate), hit.u, hit.v);
    Some((direction.try_normalize()?, tangents[0].w))
}

/// The direction in which u grows over the triangle, for meshes without tangents; handedness as that of the
/// coordinates, so that y runs where v falls (texture rows run downwards, green upwards).
fn uv_tangent(mesh: &Mesh, material: &Material, triangle: usize) -> Option<(Vec3, f32)> {
    let set = material.normal_texture.as_ref()?.uv_set;
    let [Some(a), Some(b), Some(c)] = CORNERS.map(|(u, v)| Inputs::at(mesh, triangle, u, v).uvs[usize::from(set)])
    else {
        return None;
    };
    let [p, q, r] = mesh.corners(triangle);
    let (uv1, uv2) = (b - a, c - a);
    let turn = uv1.perp_dot(uv2);
    let tangent = ((q - p) * uv2.y - (r - p) * uv1.y) * turn.signum();
    (turn != 0.0).then_some((tangent.try_normalize()?, -turn.signum()))
}

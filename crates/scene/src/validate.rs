//! Checks and repairs of what loaders and generators hand over, before anything is built from it.

use crate::{Instance, Material, Mesh, Report, SceneError, SceneParts, texture::TextureRef};
use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;
use std::path::PathBuf;

/// Coordinates beyond this are refused: squares and cross products of larger ones leave the range of f32.
const MAX_COORDINATE: f32 = 1e12;

/// Makes everything true that the crate promises after [`crate::Scene::new`]: an index out of range, a stream of the wrong length
/// or a position that is not finite is an error; normals, colours and factors are repaired, with a warning.
pub(crate) fn validate(parts: &mut SceneParts) -> Result<(), SceneError> {
    if parts.origins.is_empty() {
        parts.origins.push(Default::default());
    }
    let fault = Fault {
        name: parts.name.clone(),
    };
    check_textures(parts, &fault)?;
    let textures = parts.textures.len();
    let report = &mut parts.report;
    for (index, material) in parts.materials.iter_mut().enumerate() {
        check_material(index, material, textures, &fault)?;
        repair_material(material, report);
    }
    let (materials, origins) = (parts.materials.len(), parts.origins.len());
    for (index, mesh) in parts.meshes.iter_mut().enumerate() {
        // Others are found sound when they are read.
        if !mesh.is_deferred() {
            check_mesh(index, mesh, materials, origins, &fault)?;
            repair_mesh(mesh, report);
        }
    }
    check_instances(parts, &fault)?;
    parts.cameras.retain(|camera| {
        let usable = camera.world_from_camera.is_finite() && camera.fov_y > 0.0 && camera.fov_y < std::f32::consts::PI;
        if !usable {
            parts.report.warn(format!(
                "camera '{}': matrix or angle of view is unusable, camera left out",
                camera.name
            ));
        }
        usable
    });
    Ok(())
}

/// Makes the errors of this module.
struct Fault {
    name: String,
}

impl Fault {
    fn at(&self, place: impl Into<String>, problem: impl Into<String>, remedy: &str) -> SceneError {
        SceneError::Invalid {
            path: PathBuf::from(&self.name),
            place: place.into(),
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }

    fn index(&self, place: impl Into<String>, what: &str, index: u32, count: usize) -> SceneError {
        let problem = format!("refers to {what} {index}, but there are {count}");
        self.at(place, problem, "export the file again")
    }
}

fn check_textures(parts: &SceneParts, fault: &Fault) -> Result<(), SceneError> {
    for (index, texture) in parts.textures.iter().enumerate() {
        let texels = u64::from(texture.width) * u64::from(texture.height);
        if texels == 0 || texels != texture.texels.len() as u64 {
            return Err(fault.at(
                format!("texture {index} '{}'", texture.name),
                format!(
                    "{} texels for {} x {}",
                    texture.texels.len(),
                    texture.width,
                    texture.height
                ),
                "replace the image",
            ));
        }
    }
    Ok(())
}

fn check_material(index: usize, material: &Material, textures: usize, fault: &Fault) -> Result<(), SceneError> {
    for reference in texture_refs(material).into_iter().flatten() {
        let place = format!("material {index} '{}'", material.name);
        if reference.texture as usize >= textures {
            return Err(fault.index(place, "texture", reference.texture, textures));
        }
        if reference.uv_set > 1 {
            return Err(fault.index(place, "texture coordinates", u32::from(reference.uv_set), 2));
        }
    }
    Ok(())
}

/// The textures that a material names.
pub(crate) fn texture_refs(material: &Material) -> [Option<&TextureRef>; 4] {
    [
        material.base_color_texture.as_ref(),
        material.metallic_roughness_texture.as_ref(),
        material.normal_texture.as_ref(),
        material.emissive_texture.as_ref(),
    ]
}

fn repair_material(material: &mut Material, report: &mut Report) {
    let name = &material.name;
    let mut number = |what: &str, value: &mut f32, low: f32, high: f32, otherwise: f32| {
        let repaired = if value.is_nan() {
            otherwise
        } else {
            value.clamp(low, high)
        };
        if repaired != *value {
            report.warn(format!("material '{name}': {what} {value} set to {repaired}"));
            *value = repaired;
        }
    };
    // Beyond 1e30 the power of a light would leave the range of f32.
    for (what, color, high) in [
        ("base colour", &mut material.base_color, 1.0),
        ("reflectance", &mut material.dielectric_f0, 1.0),
        ("emission", &mut material.emission, 1e30),
    ] {
        for channel in color.as_mut() {
            // An infinite emission is a mistake, not a very bright light.
            if *channel == f32::INFINITY {
                *channel = f32::NAN;
            }
            number(what, channel, 0.0, high, 0.0);
        }
    }
    number("metallic", &mut material.metallic, 0.0, 1.0, 0.0);
    number("roughness", &mut material.roughness, 0.0, 1.0, 1.0);
    number("specular", &mut material.dielectric_f90, 0.0, 1.0, 0.0);
    number("alpha", &mut material.alpha, 0.0, 1.0, 1.0);
    number("normal scale", &mut material.normal_scale, -1e3, 1e3, 1.0);
    if let Some(cutoff) = &mut material.alpha_cutoff {
        number("alpha cutoff", cutoff, 0.0, f32::MAX, 0.5);
    }
}

fn check_mesh(index: usize, mesh: &Mesh, materials: usize, origins: usize, fault: &Fault) -> Result<(), SceneError> {
    let place = || match mesh.name.as_str() {
        "" => format!("mesh {index}"),
        name => format!("mesh {index} '{name}'"),
    };
    let vertices = mesh.positions.len();
    if mesh.len() >= u32::MAX as usize || vertices >= u32::MAX as usize {
        let remedy = "split it";
        return Err(fault.at(place(), "has more than 2^32 - 2 triangles or vertices", remedy));
    }
    for (stream, len) in [
        ("normals", mesh.normals.len()),
        ("texture coordinates", mesh.uvs.len()),
        ("texture coordinates of set 1", mesh.uvs1.len()),
        ("tangents", mesh.tangents.len()),
        ("colours", mesh.colors.len()),
    ] {
        if len != 0 && len != vertices {
            let problem = format!("{len} {stream} for {vertices} vertices");
            return Err(fault.at(place(), problem, "export the file again"));
        }
    }
    let triangles = mesh.len();
    if mesh.materials.len() != triangles || !(mesh.origins.is_empty() || mesh.origins.len() == triangles) {
        let problem = format!(
            "{} materials and {} origins for {triangles} triangles",
            mesh.materials.len(),
            mesh.origins.len()
        );
        return Err(fault.at(place(), problem, "give each triangle one"));
    }
    let out_of_range = |list: &[u32], count: usize| list.par_iter().find_first(|i| **i as usize >= count).copied();
    if let Some(&wrong) = mesh
        .indices
        .as_flattened()
        .par_iter()
        .find_first(|i| **i as usize >= vertices)
    {
        return Err(fault.index(place(), "vertex", wrong, vertices));
    }
    if let Some(wrong) = out_of_range(&mesh.materials, materials) {
        return Err(fault.index(place(), "material", wrong, materials));
    }
    if let Some(wrong) = out_of_range(&mesh.origins, origins) {
        return Err(fault.index(place(), "origin", wrong, origins));
    }
    // Also false for NaN.
    let usable = |p: &Vec3| p.abs().max_element() <= MAX_COORDINATE && !p.is_nan();
    if let Some(vertex) = mesh.positions.par_iter().position_first(|p| !usable(p)) {
        let problem = format!("position of vertex {vertex} is {}", mesh.positions[vertex]);
        return Err(fault.at(place(), problem, "coordinates must be finite, and at most 1e12"));
    }
    Ok(())
}

/// Makes normals and tangents unit vectors or zero, and texture coordinates and colours finite.
pub(crate) fn repair_mesh(mesh: &mut Mesh, report: &mut Report) {
    let name = mesh.name.clone();
    let mut tell = |what: &str, count: usize| {
        if count > 0 {
            report.warn(format!("mesh '{name}': {count} {what}"));
        }
    };
    let repaired = |count: &mut [Vec3]| {
        count
            .par_iter_mut()
            .map(|normal| {
                let broken = !normal.is_finite();
                // Zero stays zero: "flat here".
                *normal = normal.as_dvec3().normalize_or_zero().as_vec3();
                usize::from(broken)
            })
            .sum()
    };
    tell("normals not finite, shaded flat there", repaired(&mut mesh.normals));
    let tangents = mesh.tangents.par_iter_mut().map(|tangent| {
        let direction = tangent.truncate().as_dvec3().normalize_or_zero().as_vec3();
        let broken = !tangent.is_finite();
        *tangent = direction.extend(if tangent.w < 0.0 { -1.0 } else { 1.0 });
        usize::from(broken)
    });
    tell("tangents not finite, not normal-mapped there", tangents.sum());
    for uvs in [&mut mesh.uvs, &mut mesh.uvs1] {
        let broken: usize = uvs
            .par_iter_mut()
            .map(|uv| {
                let broken = !uv.is_finite();
                if broken {
                    *uv = Vec2::ZERO;
                }
                usize::from(broken)
            })
            .sum();
        tell("texture coordinates not finite, set to 0", broken);
    }
    mesh.colors.par_iter_mut().for_each(|color| {
        let finite = if color.is_nan() { Vec4::ONE } else { *color };
        *color = finite.clamp(Vec4::ZERO, Vec4::ONE);
    });
}

/// Derives inverse and normal transforms anew, so that they agree with `world_from_local` whoever filled them in.
fn check_instances(parts: &mut SceneParts, fault: &Fault) -> Result<(), SceneError> {
    let mut kept = Vec::with_capacity(parts.instances.len());
    for (index, instance) in parts.instances.iter().enumerate() {
        let place = || format!("instance {index}");
        if instance.mesh as usize >= parts.meshes.len() {
            return Err(fault.index(place(), "mesh", instance.mesh, parts.meshes.len()));
        }
        if instance.origin as usize >= parts.origins.len() {
            return Err(fault.index(place(), "origin", instance.origin, parts.origins.len()));
        }
        let matrix = instance.world_from_local.to_cols_array();
        // Also true for NaN.
        if !matrix.iter().all(|x| x.abs() <= MAX_COORDINATE) {
            let remedy = "transforms must be finite, and at most 1e12";
            return Err(fault.at(place(), "its transform is not finite", remedy));
        }
        match Instance::new(instance.mesh, instance.origin, instance.world_from_local) {
            Some(checked) => kept.push(checked),
            None => {
                let (node, _) = &parts.origins[instance.origin as usize];
                let text = format!("node '{node}': squashed flat by its transform, left out");
                parts.report.warn(text);
            }
        }
    }
    parts.instances = kept;
    Ok(())
}

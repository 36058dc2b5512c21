//! glTF 2.0 in, [`SceneParts`] out.
//!
//! A file is not trusted: every index and byte range is checked before it is followed, and what a file unfolds to is
//! bounded by its size. A file that is wrong is refused with the place and a remedy; a file that asks for more than
//! this renderer does is shown without, and the report counts what is missing.

mod accessor;
mod bounds;
mod cameras;
mod census;
mod deferred;
mod encoded;
mod framing;
mod geometry;
mod images;
mod json;
mod lights;
mod materials;
mod merge;
mod nodes;
mod source;
mod tangents;
#[cfg(test)]
mod tests;

use crate::{Instance, Material, Mesh, SceneError, SceneParts, StoredMesh};
use bounds::Bounds;
use geometry::{Budget, mesh_name};
use json::Instancing;
use materials::Needs;
use merge::{Motion, append};
use nodes::Placed;
use source::Source;
use std::path::Path;
use std::sync::Arc;

/// Triangles that placing a mesh again may add to the static mesh; beyond that, the mesh is instanced. Higher values make
/// rays cheaper, lower values save memory.
const MAX_COPIED_TRIANGLES: usize = 20_000;

/// Bytes up to which a binary file is read as a whole. Larger ones stay on the disk, and so do their meshes, each until a ray first comes near
/// it: what is never seen takes neither time nor memory, but is not checked either. Lower values save memory; higher values trace small scenes
/// faster, because what is placed once has one tree then.
const MAX_WHOLE: u64 = 64 << 20;

/// Reads a `.gltf` or `.glb` file. Textures are decoded when they are first sampled, see [`crate::stored::Texels`]; a mesh of a large file may
/// be read later, see [`crate::StoredMesh`].
///
/// # Errors
/// [`SceneError`], naming file, place and remedy.
pub fn read(path: &Path) -> Result<SceneParts, SceneError> {
    read_above(path, MAX_WHOLE)
}

/// [`read`], leaving the larger meshes of binary files of more than `max_whole` bytes where they are until they are needed.
///
/// # Errors
/// Those of [`read`].
pub fn read_above(path: &Path, max_whole: u64) -> Result<SceneParts, SceneError> {
    let source = Arc::new(Source::open(path, max_whole)?);
    let mut parts = SceneParts {
        name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        ..SceneParts::default()
    };
    let mut report = std::mem::take(&mut parts.report);
    census::count_ignored(&source.json, &mut report);

    let mut placed = nodes::walk(&source, &mut report)?;
    parts.origin_ws = nodes::recentre(&source, &mut placed);
    let mut budget = Budget::new(source.bytes);
    let placements = placements(&source, &placed, &mut budget)?;

    let used = used_materials(&source, &placements)?;
    let mut images = images::Images::default();
    let (materials, needs) = materials::read(&source, &used, &mut images, &mut report)?;
    let unused = source.json.images.len() - images.distinct();
    if unused > 0 {
        report
            .skipped
            .push(format!("{unused} images that no visible material needs: not decoded"));
    }
    parts.textures = images.textures(&source, &parts.memory)?;
    parts.materials = materials;
    if used.last() == Some(&false) {
        parts.materials.pop();
    }

    let needs: Arc<[Needs]> = needs.into();
    for (index, placements) in placements.iter().enumerate().filter(|(_, p)| !p.is_empty()) {
        let emits = |material: usize| parts.materials.get(material).is_some_and(Material::emits);
        let later = match source.on_disk() {
            true => deferred::mesh(&source, index, &needs, emits, &mut budget, &parts.memory)?,
            false => None,
        };
        let mesh = match later {
            Some(mesh) => mesh,
            None => geometry::read_mesh(&source, index, &needs, &mut budget, &mut report)?.into(),
        };
        let name = mesh_name(index, &source.json.meshes[index]);
        place(&source, mesh, &name, placements, &mut parts, &mut budget)?;
    }
    finish_static_mesh(&mut parts);

    let bounds = Bounds::of(&parts);
    if bounds.max.max(-bounds.min).max_element() > geometry::MAX_COORDINATE {
        let problem = format!("geometry is placed more than {:e} m away", geometry::MAX_COORDINATE);
        return Err(source.invalid("scene", problem, "scale the scene down"));
    }
    parts.punctual = lights::read(&source, &placed, &mut report)?;
    parts.cameras = cameras::read(&source, &placed, &parts, &bounds, &mut report)?;
    source.check_unchanged()?;
    parts.report = report;
    remark(&mut parts, needs.iter().any(|needs| needs.tangents_for.is_some()));
    Ok(parts)
}

/// Where each mesh of the file stands.
fn placements(source: &Source, placed: &[Placed], budget: &mut Budget) -> Result<Vec<Vec<Placed>>, SceneError> {
    let mut placements = vec![Vec::new(); source.json.meshes.len()];
    for node in placed {
        let json = &source.json.nodes[node.node];
        let Some(mesh) = json.mesh.map(|mesh| mesh.value()) else {
            continue;
        };
        let place = nodes::label(source, node.node);
        let Some(list) = placements.get_mut(mesh) else {
            return Err(source.no_such(place, "mesh", mesh, source.json.meshes.len()));
        };
        match Instancing::of(json) {
            None => list.push(*node),
            Some(instancing) => {
                let instancing = instancing
                    .map_err(|error| source.invalid(&place, format!("instancing: {error}"), "export the file again"))?;
                let copies = nodes::instancing(source, node.node, &instancing)?;
                budget.take(source, &place, copies.len() as u64)?;
                list.extend(copies.into_iter().map(|local| Placed {
                    node: node.node,
                    world: node.world * local,
                }));
            }
        }
    }
    Ok(placements)
}

/// Which materials placed triangles have; the last entry is for the default material.
fn used_materials(source: &Source, placements: &[Vec<Placed>]) -> Result<Vec<bool>, SceneError> {
    let count = source.json.materials.len();
    let mut used = vec![false; count + 1];
    for (index, mesh) in source.json.meshes.iter().enumerate() {
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let material = primitive.material.map_or(count, |material| material.value());
            if material >= count && primitive.material.is_some() {
                let place = format!("mesh {index} '{}' primitive {number}", mesh_name(index, mesh));
                return Err(source.no_such(place, "material", material, count));
            }
            let visible = geometry::has_triangles(primitive.mode) && !placements[index].is_empty();
            used[material] |= visible;
        }
    }
    Ok(used)
}

/// Puts a mesh where it stands: copied into the static mesh 0, or, where the copies would be large, as instances.
fn place(
    source: &Source,
    mesh: StoredMesh,
    name: &str,
    placements: &[Placed],
    parts: &mut SceneParts,
    budget: &mut Budget,
) -> Result<(), SceneError> {
    if mesh.is_empty() {
        return Ok(());
    }
    if parts.meshes.is_empty() {
        parts.meshes.push(StoredMesh::default());
    }
    let shared = mesh.is_deferred() || (placements.len() - 1).saturating_mul(mesh.len()) > MAX_COPIED_TRIANGLES;
    let local = parts.meshes.len() as u32;
    let mut last_origin = None;
    let mut instanced = false;
    for placement in placements {
        if last_origin != Some(placement.node) {
            last_origin = Some(placement.node);
            let node = source.json.nodes[placement.node].name.clone();
            let node = node.unwrap_or_else(|| format!("node {}", placement.node));
            parts.origins.push((node, name.to_owned()));
        }
        let origin = parts.origins.len() as u32 - 1;
        let motion = Motion::new(placement.world);
        if shared && let Some(instance) = motion.instance(local, origin) {
            parts.instances.push(instance);
            instanced = true;
            continue;
        }
        let size = mesh.len() + mesh.positions.len();
        budget.take(source, &nodes::label(source, placement.node), size as u64)?;
        let fixed = &mut parts.meshes[0];
        append(fixed, &mesh, Some(&motion));
        fixed.materials.extend_from_slice(&mesh.materials);
        fixed.origins.extend(std::iter::repeat_n(origin, mesh.len()));
    }
    if instanced {
        parts.meshes.push(mesh);
    }
    Ok(())
}

/// Mesh 0 becomes instance 0, or is removed if nothing went into it.
fn finish_static_mesh(parts: &mut SceneParts) {
    match parts.meshes.first() {
        None => {}
        Some(fixed) if fixed.is_empty() => {
            parts.meshes.remove(0);
            parts.instances.iter_mut().for_each(|instance| instance.mesh -= 1);
        }
        Some(_) => parts.instances.insert(0, Instance::identity(0, 0)),
    }
}

/// Notes what is odd about the whole, and what is not there.
fn remark(parts: &mut SceneParts, mapped: bool) {
    let read = || parts.meshes.iter().filter(|mesh| !mesh.is_deferred());
    let degenerate: usize = read().map(|mesh| zero_area_triangles(mesh)).sum();
    let report = &mut parts.report;
    let later = parts.meshes.len() - read().count();
    if later > 0 {
        report.skipped.push(format!(
            "{later} meshes stay in the file until a ray comes near them: not read, not checked"
        ));
    }
    if degenerate > 0 {
        report.warn(format!("{degenerate} triangles have no area: no ray meets them"));
    }
    if parts.instances.is_empty() {
        report.warn("the scene has no triangles: the image will be black");
    }
    let emitting = |mesh: &StoredMesh| mesh.materials.iter().any(|&m| parts.materials[m as usize].emits());
    if parts.punctual.is_empty() && !read().any(emitting) {
        report.warn("the scene has no lights: the image will be black");
    }
    if !parts.textures.is_empty() && !mapped {
        report.skipped.push("no normal maps: no tangents".into());
    }
}

fn zero_area_triangles(mesh: &Mesh) -> usize {
    (0..mesh.len())
        .filter(|&i| {
            let [a, b, c] = mesh.corners(i).map(|p| p.as_dvec3());
            (b - a).cross(c - a) == glam::DVec3::ZERO
        })
        .count()
}

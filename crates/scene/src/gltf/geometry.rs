//! A glTF mesh as one [`Mesh`] in its local space.

use super::accessor::Accessor;
use super::json::{self, Checked, Mode, Primitive, Semantic, Type};
use super::materials::Needs;
use super::merge::append;
use super::source::Source;
use super::tangents;
use crate::{Mesh, Report, SceneError};
use glam::{Vec2, Vec3, Vec4};

/// Largest coordinate that is read, metres: the fourth power of a length must be a finite `f32`.
pub(super) const MAX_COORDINATE: f32 = 1e9;

/// What a file may grow to. Accessors may be shared by any number of primitives, and meshes by any number of nodes, so
/// bounds on each of them do not bound the whole.
#[derive(Debug)]
pub(super) struct Budget {
    left: u64,
    total: u64,
}

impl Budget {
    /// For a file of so many bytes.
    pub(super) fn new(bytes: u64) -> Self {
        let total = 2_000_000 + bytes.saturating_mul(2);
        Self { left: total, total }
    }

    /// Takes `elements` (triangle corners, vertices, placements) off.
    pub(super) fn take(&mut self, source: &Source, place: &str, elements: u64) -> Result<(), SceneError> {
        self.left = self.left.checked_sub(elements).ok_or_else(|| {
            source.invalid(
                place,
                format!("the file unfolds to more than {} triangles and vertices", self.total),
                "share less data between primitives and nodes",
            )
        })?;
        Ok(())
    }
}

/// Reads mesh `index` with the streams that its materials need.
pub(super) fn read_mesh(
    source: &Source,
    index: usize,
    needs: &[Needs],
    budget: &mut Budget,
    report: &mut Report,
) -> Result<Mesh, SceneError> {
    let json = &source.json.meshes[index];
    let mut mesh = Mesh {
        name: mesh_name(index, json),
        ..Mesh::default()
    };
    for (number, primitive) in json.primitives.iter().enumerate() {
        let place = format!("mesh {index} '{}' primitive {number}", mesh.name);
        let material = (primitive.material).map_or(needs.len() - 1, |material| material.value());
        let reader = PrimitiveReader {
            source,
            primitive,
            place,
            needs: needs[material],
        };
        if let Some(part) = reader.read(budget, report)? {
            mesh.materials.extend(std::iter::repeat_n(material as u32, part.len()));
            append(&mut mesh, &part, None);
        }
    }
    Ok(mesh)
}

/// The name of a mesh, made up if it has none.
pub(super) fn mesh_name(index: usize, json: &json::Mesh) -> String {
    json.name.clone().unwrap_or_else(|| format!("mesh {index}"))
}

/// Whether primitives of this mode are drawn.
pub(super) fn has_triangles(mode: Checked<Mode>) -> bool {
    matches!(
        mode,
        Checked::Valid(Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)
    )
}

struct PrimitiveReader<'a> {
    source: &'a Source,
    primitive: &'a Primitive,
    place: String,
    needs: Needs,
}

impl<'a> PrimitiveReader<'a> {
    fn read(&self, budget: &mut Budget, report: &mut Report) -> Result<Option<Mesh>, SceneError> {
        let Checked::Valid(mode) = self.primitive.mode else {
            return Err(self.invalid("unknown mode"));
        };
        if !has_triangles(self.primitive.mode) {
            let what = if mode == Mode::Points { "points" } else { "lines" };
            report.ignore(format!("primitives of {what}"));
            return Ok(None);
        }
        if self.primitive.targets.iter().flatten().next().is_some() {
            report.ignore("morph targets");
        }
        let Some(positions) = self.attribute(Semantic::Positions, &[Type::Vec3])? else {
            report.warn(format!("{}: no POSITION, left out", self.place));
            return Ok(None);
        };
        let corners = self.corners(positions.len(), budget)?;
        let mut triangles = assemble(mode, &corners);
        if mode == Mode::Triangles && corners.len() % 3 != 0 {
            report.warn(format!(
                "{}: {} indices are no multiple of 3",
                self.place,
                corners.len()
            ));
        }
        if triangles.is_empty() {
            report.warn(format!("{}: no triangles, left out", self.place));
            return Ok(None);
        }
        let used = compact(&mut triangles);
        budget.take(self.source, &self.place, used.len() as u64)?;
        let mut mesh = Mesh {
            positions: self.positions(&positions, &used)?,
            indices: triangles,
            ..Mesh::default()
        };
        if let Some(normals) = self.attribute(Semantic::Normals, &[Type::Vec3])? {
            let read = |v: [f32; 4]| Vec3::new(v[0], v[1], v[2]).normalize_or_zero();
            mesh.normals = self.stream("NORMAL", &normals, positions.len(), &used, read)?;
        }
        let uv = |v: [f32; 4]| finite2(Vec2::new(v[0], v[1]));
        for (set, stream) in [(0, &mut mesh.uvs), (1, &mut mesh.uvs1)] {
            let name = &format!("TEXCOORD_{set}");
            if self.needs.uv_sets & 1 << set == 0 {
                continue;
            }
            match self.attribute(Semantic::TexCoords(set), &[Type::Vec2])? {
                Some(uvs) => *stream = self.stream(name, &uvs, positions.len(), &used, uv)?,
                None => report.warn(format!(
                    "{}: its material has a texture, but there is no {name}",
                    self.place
                )),
            }
        }
        if let Some(colors) = self.attribute(Semantic::Colors(0), &[Type::Vec3, Type::Vec4])? {
            let opaque = colors.width() == 3;
            let read = |v: [f32; 4]| Vec4::new(v[0], v[1], v[2], if opaque { 1.0 } else { v[3] });
            let clean = |v: [f32; 4]| read(v.map(|c| if c > 0.0 { c.min(1.0) } else { 0.0 }));
            mesh.colors = self.stream("COLOR_0", &colors, positions.len(), &used, clean)?;
            if mesh.colors.iter().all(|&color| color == Vec4::ONE) {
                mesh.colors = Vec::new();
            }
        }
        if let Some(set) = self.needs.tangents_for {
            self.tangents(&mut mesh, positions.len(), &used, set)?;
        }
        Ok(Some(mesh))
    }

    /// glTF 2.0 section 3.7.2.1: tangents of the file count only together with normals; without, they are computed.
    fn tangents(&self, mesh: &mut Mesh, count: usize, used: &[u32], set: u8) -> Result<(), SceneError> {
        match self.attribute(Semantic::Tangents, &[Type::Vec4])? {
            Some(tangents) if !mesh.normals.is_empty() => {
                let read = |v: [f32; 4]| {
                    let direction = Vec3::new(v[0], v[1], v[2]).try_normalize().unwrap_or(Vec3::X);
                    direction.extend(if v[3] < 0.0 { -1.0 } else { 1.0 })
                };
                mesh.tangents = self.stream("TANGENT", &tangents, count, used, read)?;
            }
            _ => tangents::generate(mesh, set),
        }
        Ok(())
    }

    fn attribute(&self, semantic: Semantic, shapes: &[Type]) -> Result<Option<Accessor<'a>>, SceneError> {
        let name = semantic.to_string();
        let Some(&index) = self.primitive.attributes.get(&Checked::Valid(semantic)) else {
            return Ok(None);
        };
        let accessor = Accessor::open(self.source, index, &format!("{} {name}", self.place), shapes)?;
        if accessor.is_u32() {
            return Err(self.invalid(format!("{name} has 32-bit integers")));
        }
        Ok(Some(accessor))
    }

    /// The vertex of every corner, all in range.
    fn corners(&self, vertices: usize, budget: &mut Budget) -> Result<Vec<u32>, SceneError> {
        let Some(index) = self.primitive.indices else {
            budget.take(self.source, &self.place, vertices as u64)?;
            return Ok((0..vertices as u32).collect());
        };
        let what = format!("{} indices", self.place);
        let indices = Accessor::open(self.source, index, &what, &[Type::Scalar])?;
        if !indices.is_unsigned() {
            return Err(self.invalid("indices are not unsigned integers"));
        }
        budget.take(self.source, &self.place, indices.len() as u64)?;
        let corners: Vec<u32> = (0..indices.len()).map(|i| indices.index(i)).collect();
        match corners.iter().position(|&vertex| vertex as usize >= vertices) {
            Some(at) => Err(self.invalid(format!(
                "index {at} is {}, but there are only {vertices} vertices",
                corners[at]
            ))),
            None => Ok(corners),
        }
    }

    fn positions(&self, accessor: &Accessor<'_>, used: &[u32]) -> Result<Vec<Vec3>, SceneError> {
        used.iter()
            .map(|&vertex| {
                let [x, y, z, _] = accessor.floats(vertex as usize);
                let position = Vec3::new(x, y, z);
                // NaN fails the comparison too.
                if position.abs().max_element() <= MAX_COORDINATE && position.is_finite() {
                    return Ok(position);
                }
                let problem = if position.is_finite() {
                    format!("is more than {MAX_COORDINATE:e} m away")
                } else {
                    "is not finite".into()
                };
                let accessor = self.primitive.attributes[&Checked::Valid(Semantic::Positions)];
                Err(self.source.invalid(
                    format!("{}, accessor {accessor}", self.place),
                    format!("POSITION {vertex} is ({x}, {y}, {z}), which {problem}"),
                    "correct the vertex and export the file again",
                ))
            })
            .collect()
    }

    fn stream<T>(
        &self,
        name: &str,
        accessor: &Accessor<'_>,
        count: usize,
        used: &[u32],
        read: impl Fn([f32; 4]) -> T,
    ) -> Result<Vec<T>, SceneError> {
        if accessor.len() != count {
            return Err(self.invalid(format!("{name} has {} elements, POSITION {count}", accessor.len())));
        }
        Ok(used
            .iter()
            .map(|&vertex| read(accessor.floats(vertex as usize)))
            .collect())
    }

    fn invalid(&self, problem: impl Into<String>) -> SceneError {
        self.source
            .invalid(&self.place, problem, "the file is damaged: export it again")
    }
}

fn finite2(v: Vec2) -> Vec2 {
    if v.is_finite() { v } else { Vec2::ZERO }
}

/// Triangles of corners by mode (glTF 2.0 section 3.7.2.1); those of strips and fans that repeat a vertex are joints
/// and are dropped.
fn assemble(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
    let solid = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    match mode {
        Mode::TriangleStrip => corners
            .windows(3)
            .enumerate()
            .map(|(i, w)| {
                if i % 2 == 0 {
                    [w[0], w[1], w[2]]
                } else {
                    [w[0], w[2], w[1]]
                }
            })
            .filter(solid)
            .collect(),
        Mode::TriangleFan => corners
            .get(1..)
            .unwrap_or_default()
            .windows(2)
            .map(|w| [w[0], w[1], corners[0]])
            .filter(solid)
            .collect(),
        _ => corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}

/// Renumbers vertices so that only used ones remain; returns the old number of each new one, increasing. Many exporters
/// share one vertex buffer among all primitives of a file.
fn compact(triangles: &mut [[u32; 3]]) -> Vec<u32> {
    let corners = triangles.as_flattened_mut();
    let (Some(&low), Some(&high)) = (corners.iter().min(), corners.iter().max()) else {
        return Vec::new();
    };
    let range = (high - low) as usize + 1;
    if range > 4 * corners.len() {
        let mut used = corners.to_vec();
        used.sort_unstable();
        used.dedup();
        for corner in corners {
            *corner = used.partition_point(|old| old < corner) as u32;
        }
        return used;
    }
    let mut new = vec![u32::MAX; range];
    for corner in corners.iter() {
        new[(corner - low) as usize] = 0;
    }
    let mut used = Vec::new();
    for (old, new) in (low..=high).zip(&mut new) {
        if *new == 0 {
            *new = used.len() as u32;
            used.push(old);
        }
    }
    for corner in corners {
        *corner = new[(*corner - low) as usize];
    }
    used
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_alternate_and_fans_turn_round_their_first_vertex() {
        assert_eq!(
            assemble(Mode::TriangleStrip, &[0, 1, 2, 3, 4]),
            [[0, 1, 2], [1, 3, 2], [2, 3, 4]]
        );
        assert_eq!(assemble(Mode::TriangleStrip, &[0, 1, 2, 2, 3]), [[0, 1, 2]]);
        assert_eq!(assemble(Mode::TriangleFan, &[7, 1, 2, 3]), [[1, 2, 7], [2, 3, 7]]);
        assert_eq!(assemble(Mode::TriangleFan, &[]), [[0_u32; 3]; 0]);
        assert_eq!(assemble(Mode::Triangles, &[0, 1, 2, 3]), [[0, 1, 2]]);
    }

    #[test]
    fn compaction_keeps_triangles_by_either_way() {
        for spread in [1, 1000] {
            let mut triangles = [[5, 9, 7], [7, 9, 12]].map(|t| t.map(|v: u32| v * spread));
            let before = triangles;
            let used = compact(&mut triangles);
            assert_eq!(used, [5, 7, 9, 12].map(|v| v * spread));
            assert_eq!(triangles.map(|t| t.map(|v| used[v as usize])), before);
        }
        assert!(compact(&mut []).is_empty());
    }
}

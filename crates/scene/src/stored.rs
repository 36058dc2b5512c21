//! Meshes that stay in their file until somebody needs them.

use crate::alone::alone;
use crate::{Mesh, SceneError};
use glam::Vec3;
use std::fmt;
use std::ops::{Deref, DerefMut};
use std::sync::{Arc, OnceLock};

/// A mesh of a scene. It is used like the [`Mesh`] that it stands for; one that is still in its file is read by the first use of any of its
/// streams, and only what [`StoredMesh`] itself answers is known without.
#[derive(Clone, Debug, Default)]
pub struct StoredMesh {
    mesh: OnceLock<Mesh>,
    deferred: Option<Arc<Deferred>>,
}

/// What is known of a mesh that has not been read.
#[derive(Clone, Copy, Debug)]
pub struct Outline {
    /// Number of triangles. None of them emits.
    pub triangles: usize,
    /// Corners of the box around its vertices, local space: what its file claims, and what is checked when it is read.
    pub bounds: [Vec3; 2],
    /// Whether it has vertex normals.
    pub smooth: bool,
}

/// A mesh in its file.
struct Deferred {
    outline: Outline,
    read: Box<dyn Fn() -> Result<Mesh, SceneError> + Send + Sync>,
    fault: OnceLock<SceneError>,
}

impl fmt::Debug for Deferred {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Deferred({:?}, fault: {:?})", self.outline, self.fault)
    }
}

impl From<Mesh> for StoredMesh {
    fn from(mesh: Mesh) -> Self {
        Self {
            mesh: mesh.into(),
            deferred: None,
        }
    }
}

impl StoredMesh {
    /// A mesh that `read` gets from its file when it is first needed. It must be valid, without emitting triangles, and as `outline` says.
    pub(crate) fn deferred(
        outline: Outline,
        read: impl Fn() -> Result<Mesh, SceneError> + Send + Sync + 'static,
    ) -> Self {
        Self {
            mesh: OnceLock::new(),
            deferred: Some(Arc::new(Deferred {
                outline,
                read: Box::new(read),
                fault: OnceLock::new(),
            })),
        }
    }

    /// The mesh without reading it, or what is known of it.
    fn known(&self) -> Result<&Mesh, &Outline> {
        match &self.deferred {
            Some(deferred) => Err(&deferred.outline),
            None => Ok(self),
        }
    }

    /// Whether it came from a file that it is read from when it is needed: it may have been read meanwhile.
    pub fn is_deferred(&self) -> bool {
        self.deferred.is_some()
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.known().map_or_else(|outline| outline.triangles, Mesh::len)
    }

    /// Whether the mesh has no triangle.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether no triangle has vertex normals.
    pub fn is_flat(&self) -> bool {
        self.known()
            .map_or_else(|outline| !outline.smooth, |mesh| mesh.normals.is_empty())
    }

    /// The corners of the box around all triangles, local space, the lower one first; it is the upper one if there are none. Vertices that no
    /// triangle uses do not count, unless the mesh is deferred.
    pub fn bounds(&self) -> [Vec3; 2] {
        let of_corners = |mesh: &Mesh| {
            let corners = mesh.indices.as_flattened().iter().map(|&v| mesh.positions[v as usize]);
            corners.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], p| {
                [low.min(p), high.max(p)]
            })
        };
        self.known().map_or_else(|outline| outline.bounds, of_corners)
    }

    /// Why the mesh could not be read, if so. It is empty then.
    pub fn fault(&self) -> Option<&SceneError> {
        self.deferred.as_ref().and_then(|deferred| deferred.fault.get())
    }
}

impl Deref for StoredMesh {
    type Target = Mesh;

    #[inline]
    fn deref(&self) -> &Mesh {
        self.mesh.get_or_init(|| match &self.deferred {
            None => Mesh::default(),
            Some(deferred) => alone(|| (deferred.read)()).unwrap_or_else(|error| {
                deferred.fault.get_or_init(|| error);
                Mesh::default()
            }),
        })
    }
}

impl DerefMut for StoredMesh {
    /// Reads the mesh; what is changed in it stays.
    fn deref_mut(&mut self) -> &mut Mesh {
        let _: &Mesh = self;
        if self.fault().is_none() {
            self.deferred = None;
        }
        self.mesh.get_mut().expect("it has just been read")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outline() -> Outline {
        Outline {
            triangles: 1,
            bounds: [Vec3::ZERO, Vec3::ONE],
            smooth: false,
        }
    }

    #[test]
    fn a_mesh_is_read_by_its_first_use_and_not_again() {
        let reads = Arc::new(std::sync::atomic::AtomicU32::new(0));
        let count = reads.clone();
        let stored = StoredMesh::deferred(outline(), move || {
            count.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            Ok(Mesh {
                positions: vec![Vec3::ZERO, Vec3::X, Vec3::ONE],
                indices: vec![[0, 1, 2]],
                materials: vec![0],
                ..Mesh::default()
            })
        });
        let read = || reads.load(std::sync::atomic::Ordering::Relaxed);
        assert_eq!(
            (stored.len(), stored.is_flat(), stored.bounds()),
            (1, true, [Vec3::ZERO, Vec3::ONE])
        );
        assert_eq!(read(), 0);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| assert_eq!(stored.corners(0)[1], Vec3::X));
            }
        });
        assert_eq!(read(), 1);
        let mut changed = stored.clone();
        changed.positions[1] = Vec3::Z;
        assert_eq!((changed.corners(0)[1], stored.corners(0)[1]), (Vec3::Z, Vec3::X));
        assert!(!changed.is_deferred() && stored.is_deferred());
    }

    #[test]
    fn one_that_cannot_be_read_is_empty_and_says_why() {
        let stored = StoredMesh::deferred(outline(), || {
            Err(SceneError::Write {
                path: "nowhere".into(),
                source: std::io::Error::other("no"),
            })
        });
        assert!(stored.fault().is_none());
        assert!(stored.positions.is_empty());
        assert!(stored.fault().unwrap().to_string().contains("nowhere"));
    }
}

//! The cameras of the file, and one made up for a file without any.

use super::bounds::Bounds;
use super::framing;
use super::json;
use super::nodes::{Placed, label};
use super::source::Source;
use crate::{Camera, Report, SceneError, SceneParts};
use glam::{Affine3A, DVec3, Mat3A, Vec3};
use std::collections::BTreeSet;
use std::f32::consts::PI;

/// Angle of view of cameras whose own is unusable: 45 degrees.
const DEFAULT_FOV_Y: f32 = PI / 4.0;

/// Reads the cameras of the placed nodes; if there is none, makes one that frames the geometry of `parts`.
///
/// # Errors
/// [`SceneError::Invalid`] for a camera that does not exist.
pub(super) fn read(
    source: &Source,
    placed: &[Placed],
    parts: &SceneParts,
    bounds: &Bounds,
    report: &mut Report,
) -> Result<Vec<Camera>, SceneError> {
    let all = &source.json.cameras;
    let mut cameras = Vec::new();
    let mut names = BTreeSet::new();
    for node in placed {
        let json = &source.json.nodes[node.node];
        let Some(index) = json.camera.map(|camera| camera.value()) else {
            continue;
        };
        let place = label(source, node.node);
        let camera = all
            .get(index)
            .ok_or_else(|| source.no_such(&place, "camera", index, all.len()))?;
        let Some(world_from_camera) = pose(node) else {
            report.warn(format!(
                "{place}: its camera has no direction or is too far away, left out"
            ));
            continue;
        };
        let distance = bounds.center().distance(world_from_camera.translation.into());
        let name = json.name.clone().or_else(|| camera.name.clone());
        let mut name = name.unwrap_or_else(|| format!("camera {index}"));
        if !names.insert(name.clone()) {
            name = format!("{name} (node {})", node.node);
            names.insert(name.clone());
        }
        cameras.push(Camera {
            fov_y: fov_y(camera, distance, &place, report),
            name,
            world_from_camera,
        });
    }
    if cameras.is_empty() {
        let (camera, how) = framing::camera(parts, bounds);
        report.warn(format!("the file has no camera: one was made up that looks {how}"));
        cameras.push(camera);
    }
    Ok(cameras)
}

/// Rotation and translation of the node: scale, shear and mirroring do not bend a camera's view.
fn pose(node: &Placed) -> Option<Affine3A> {
    let matrix = node.world.matrix3;
    let back = matrix.z_axis.try_normalize()?;
    let up = (matrix.y_axis - back * back.dot(matrix.y_axis)).try_normalize()?;
    let right: DVec3 = up.cross(back);
    let eye: Vec3 = node.world.translation.as_vec3();
    (eye.abs().max_element() <= super::geometry::MAX_COORDINATE).then(|| Affine3A {
        matrix3: Mat3A::from_cols(right.as_vec3a(), up.as_vec3a(), back.as_vec3a()),
        translation: eye.into(),
    })
}

fn fov_y(camera: &json::Camera, distance: f32, place: &str, report: &mut Report) -> f32 {
    if let Some(perspective) = &camera.perspective {
        let fov = perspective.yfov;
        if fov > 1e-4 && fov < 0.999 * PI {
            return fov;
        }
        report.warn(format!("{place}: angle of view {fov} rad, set to {DEFAULT_FOV_Y}"));
        return DEFAULT_FOV_Y;
    }
    if let Some(orthographic) = &camera.orthographic {
        report.ignore("orthographic cameras (replaced by perspective ones that see as much at the scene's centre)");
        let half = (orthographic.ymag.abs() / distance).atan();
        return if half.is_finite() {
            (2.0 * half).clamp(0.05, 2.0)
        } else {
            DEFAULT_FOV_Y
        };
    }
    report.warn(format!(
        "{place}: its camera has no projection, angle of view set to {DEFAULT_FOV_Y}"
    ));
    DEFAULT_FOV_Y
}

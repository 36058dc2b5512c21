//! What a frame keeps for each pixel.

use super::reservoir::Reservoir;
use crate::Film;
use crate::film::TILE_SIZE;
use glam::{Mat3, Vec3};
use scene::Hit;
use scene::camera::CameraRays;

/// What the eye ray of a pixel has met.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) hit: Hit,
    /// Unit direction to the eye.
    pub(super) wo_ws: Vec3,
}

/// One pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pixel {
    /// `None`: nothing was hit.
    pub(super) seen: Option<Seen>,
    pub(super) reservoir: Reservoir,
}

impl Pixel {
    pub(super) const EMPTY: Self = Self {
        seen: None,
        reservoir: Reservoir::EMPTY,
    };
}

/// All pixels, tile by tile as in the film, and the camera that saw them.
#[derive(Default)]
pub(super) struct Layer {
    width: u32,
    height: u32,
    tiles: Vec<Vec<Pixel>>,
    eye_ws: Vec3,
    /// From a direction to a multiple of (column, row, 1) on the film.
    film_from_world: Mat3,
}

impl Layer {
    /// That has seen nothing, of the size of `film`.
    pub(super) fn new(film: &Film) -> Self {
        Self {
            width: film.width(),
            height: film.height(),
            tiles: film.tile_areas().map(|area| vec![Pixel::EMPTY; area]).collect(),
            ..Self::default()
        }
    }

    pub(super) fn fits(&self, film: &Film) -> bool {
        (self.width, self.height) == (film.width(), film.height())
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        self.tiles.iter_mut().for_each(|tile| tile.fill(Pixel::EMPTY));
    }

    pub(super) fn bytes(&self) -> usize {
        self.tiles.iter().map(|tile| size_of_val(&**tile)).sum()
    }

    /// The pixels of each tile, to be filled with what `camera` sees.
    pub(super) fn begin(&mut self, camera: CameraRays) -> &mut [Vec<Pixel>] {
        self.eye_ws = camera.origin_ws;
        self.film_from_world = Mat3::from_cols(camera.step_x_ws, camera.step_y_ws, camera.corner_ws).inverse();
        &mut self.tiles
    }

    /// Where the camera was.
    pub(super) fn eye_ws(&self) -> Vec3 {
        self.eye_ws
    }

    /// The pixel in that column and row, which there must be.
    #[inline]
    pub(super) fn at(&self, x: u32, y: u32) -> &Pixel {
        let (column, row) = (x / TILE_SIZE, y / TILE_SIZE);
        let tile_width = TILE_SIZE.min(self.width - column * TILE_SIZE);
        let tile = row * self.width.div_ceil(TILE_SIZE) + column;
        &self.tiles[tile as usize][((y % TILE_SIZE) * tile_width + x % TILE_SIZE) as usize]
    }

    /// The pixel in that column and row, if there is one.
    #[inline]
    pub(super) fn get(&self, x: i64, y: i64) -> Option<&Pixel> {
        let inside = (0..i64::from(self.width)).contains(&x) && (0..i64::from(self.height)).contains(&y);
        inside.then(|| self.at(x as u32, y as u32))
    }

    /// The pixel in which `position_ws` appears.
    #[inline]
    pub(super) fn pixel_of(&self, position_ws: Vec3) -> Option<&Pixel> {
        let film = self.film_from_world * (position_ws - self.eye_ws);
        if film.z <= 0.0 {
            return None;
        }
        let [x, y] = [film.x / film.z, film.y / film.z].map(|v| v.floor() as i64);
        self.get(x, y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;
    use scene::Camera;

    fn layer(width: u32, height: u32) -> (Layer, CameraRays) {
        let camera = Camera::look_at("c", Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 2.0, -1.0), Vec3::Y, 1.0);
        let rays = camera.rays(width, height);
        let mut layer = Layer::new(&Film::new(width, height, false));
        layer.begin(rays);
        (layer, rays)
    }

    #[test]
    fn a_point_is_found_in_the_pixel_whose_ray_meets_it() {
        let (mut layer, rays) = layer(50, 37);
        let corners: Vec<[u32; 2]> = (0..37).flat_map(|y| (0..50).map(move |x| [x, y])).collect();
        // Marks each pixel, tile by tile.
        let mut area = 0;
        for tile in layer.begin(rays) {
            for pixel in tile {
                pixel.reservoir.sample.light = area;
                area += 1;
            }
        }
        assert_eq!(area, 50 * 37);
        let mut met = vec![false; area as usize];
        for [x, y] in corners {
            let at = Vec2::new(x as f32 + 0.3, y as f32 + 0.8);
            let point = rays.origin_ws + rays.direction_ws(at) * 7.0;
            let pixel = layer.pixel_of(point).expect("in the image");
            assert!(std::ptr::eq(pixel, layer.at(x, y)));
            met[pixel.reservoir.sample.light as usize] = true;
            assert!(
                layer.pixel_of(rays.origin_ws - rays.direction_ws(at)).is_none(),
                "behind the eye"
            );
        }
        assert!(met.into_iter().all(|met| met));
        let outside = rays.origin_ws + rays.direction_ws(Vec2::new(-1.5, 3.0));
        assert!(layer.pixel_of(outside).is_none());
    }

    #[test]
    fn a_layer_that_has_seen_nothing_finds_nothing() {
        let layer = Layer::new(&Film::new(16, 16, false));
        assert!(layer.pixel_of(Vec3::ONE).is_none_or(|pixel| pixel.seen.is_none()));
    }
}

//! Whether a film that was read from a file can be one.

use super::{AovRecord, Film, PixelRecord, corners, tile_size};
use crate::settings::check_size;

impl Film {
    /// Whether it is as [`Film::new`] and frames could have made it: what was read from a file may be anything.
    pub(crate) fn is_sound(&self) -> bool {
        if check_size(self.width, self.height).is_err() {
            return false;
        }
        let mut corners = corners(self.width, self.height);
        let tiles_sound = self.tiles.iter().all(|tile| {
            let (width, height) = (tile.width, tile.height);
            let area = width as usize * height as usize;
            corners.next() == Some((tile.x0, tile.y0))
                && (width, height) == tile_size(self.width, self.height, tile.x0, tile.y0)
                && tile.pixels.len() == area
                && tile.aovs.len() == if self.has_aovs { area } else { 0 }
                && tile.pixels.iter().all(PixelRecord::is_sound)
                && tile.aovs.iter().all(AovRecord::is_sound)
        });
        let [sum, squares] = self.weights;
        let weights_sound = match self.frames {
            0 => sum == 0.0 && squares == 0.0,
            _ => sum > 0.0 && sum.is_finite() && squares > 0.0 && squares.is_finite(),
        };
        tiles_sound && corners.next().is_none() && weights_sound
    }
}

impl PixelRecord {
    fn is_sound(&self) -> bool {
        let weight_sound = match self.count {
            0 => self.weight == 0.0,
            _ => self.weight > 0.0 && self.weight.is_finite(),
        };
        weight_sound && self.sums.iter().all(|sum| sum.is_finite())
    }
}

impl AovRecord {
    fn is_sound(&self) -> bool {
        self.hits <= self.count && self.sums.iter().all(|sum| sum.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn what_frames_make_is_sound_and_nothing_else() {
        for aovs in [false, true] {
            let mut film = Film::new(37, 21, aovs);
            assert!(film.is_sound());
            film.add_frame(0.5, |x, y| Vec3::new(x as f32, y as f32, 1.0));
            assert!(film.is_sound());
            type Spoil = fn(&mut Film);
            let odd: [Spoil; 10] = [
                |f| f.width = 0,
                |f| f.width = 38,
                |f| f.height = u32::MAX,
                |f| f.has_aovs = !f.has_aovs,
                |f| f.tiles.truncate(3),
                |f| f.tiles[1].x0 = 99,
                |f| f.tiles[2].pixels = Default::default(),
                |f| f.tiles[0].pixels[0].weight = 0.0,
                |f| f.tiles[0].pixels[9].sums[3] = f64::NAN,
                |f| f.weights[0] = f64::INFINITY,
            ];
            for (index, spoil) in odd.into_iter().enumerate() {
                let mut spoilt = film.clone();
                spoil(&mut spoilt);
                assert!(!spoilt.is_sound(), "{index}");
            }
        }
    }
}

//! Whether a film that was read from a file can be one.

use super::{AovRecord, EarlierRecord, Film, PixelRecord, corners, tile_size};
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
                && [tile.earlier.len(), tile.rates.len()] == [if self.has_rates { area } else { 0 }; 2]
                && (!self.has_rates || u64::from(tile.block_frame) == self.frames.saturating_sub(self.block_start))
                && tile.pixels.iter().all(PixelRecord::is_sound)
                && tile.earlier.iter().all(EarlierRecord::is_sound)
                && tile.rates.iter().all(|rate| rate.is_sound())
                && tile.aovs.iter().all(AovRecord::is_sound)
        });
        let weights_sound = |frames: u64, weights: [f64; 2]| match frames {
            0 => weights == [0.0; 2],
            _ => weights.iter().all(|weight| *weight > 0.0 && weight.is_finite()),
        };
        let blocks_sound = self.block_start <= self.frames
            && self.skipped
                <= self
                    .frames
                    .saturating_mul(u64::from(self.width) * u64::from(self.height))
            && (self.has_rates || self.block_start == 0)
            && weights_sound(self.block_start, self.earlier_weights)
            && [0, 1].iter().all(|&i| self.earlier_weights[i] <= self.weights[i]);
        tiles_sound && corners.next().is_none() && weights_sound(self.frames, self.weights) && blocks_sound
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

impl EarlierRecord {
    fn is_sound(&self) -> bool {
        let spread_sound = match self.count {
            0 => self.spread == 0.0,
            _ => self.spread > 0.0 && self.spread.is_finite(),
        };
        spread_sound && self.sums.iter().all(|sum| sum.is_finite())
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
            let mut film = Film::new(37, 21, aovs).with_rates();
            assert!(film.is_sound());
            for frame in 0..20 {
                film.begin_block();
                film.add_frame(0.5, |x, y| Vec3::new(x as f32, y as f32, (frame % 3) as f32));
                assert!(film.is_sound());
            }
            type Spoil = fn(&mut Film);
            let odd: [Spoil; 17] = [
                |f| f.width = 0,
                |f| f.width = 38,
                |f| f.height = u32::MAX,
                |f| f.has_aovs = !f.has_aovs,
                |f| f.has_rates = false,
                |f| f.block_start = 21,
                |f| f.earlier_weights[1] = f64::NAN,
                |f| f.skipped = u64::MAX,
                |f| f.tiles[3].block_frame += 1,
                |f| f.tiles[3].rates = Default::default(),
                |f| f.tiles[3].earlier[5].spread = -1.0,
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

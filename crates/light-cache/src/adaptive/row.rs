//! Entries of a cut side by side, for vector instructions.

use super::branch::Branch;
use super::emitter::Emitter;
use crate::state::is_amount;
use glam::Vec3;

/// Entries of a row.
pub(super) const LANES: usize = 16;

/// A number for every lane of a row.
pub(super) type Lanes = [f32; LANES];

/// One entry of every lane.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[repr(C, align(64))]
pub(super) struct Row {
    center: [Lanes; 3],
    axis: [Lanes; 3],
    radius: Lanes,
    quarter_inverse_radius: Lanes,
    depth: Lanes,
    quarter_inverse_depth: Lanes,
    one_sided: Lanes,
    isotropic: Lanes,
    weight: Lanes,
    everywhere: Lanes,
    pub(super) branch: [Branch; LANES],
}

/// What rows with spots and lights of limited range have besides.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[repr(C, align(64))]
pub(super) struct Attenuation {
    cone_scale: Lanes,
    cone_offset: Lanes,
    inverse_range_sq: Lanes,
}

/// What entries are expected to bring, by channel, over what they weigh, both without the factors of cubes.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[repr(C, align(64))]
pub(super) struct Expected(pub(super) [Lanes; 3]);

/// An entry of a cut.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weighed {
    /// What it stands for.
    pub(super) branch: Branch,
    /// What it sends to a point, in proportion to how often it is to be drawn there.
    pub(super) emitter: Emitter,
    /// What it is expected to bring, by channel, over that.
    pub(super) expected: Vec3,
}

impl Row {
    /// Of these entries.
    pub(super) fn of(entries: &[Weighed; LANES]) -> Self {
        let lanes = |value: fn(&Emitter) -> f32| entries.map(|entry| value(&entry.emitter));
        Self {
            center: [lanes(|e| e.center.x), lanes(|e| e.center.y), lanes(|e| e.center.z)],
            axis: [lanes(|e| e.axis.x), lanes(|e| e.axis.y), lanes(|e| e.axis.z)],
            radius: lanes(|e| e.radius),
            quarter_inverse_radius: lanes(|e| e.quarter_inverse_radius),
            depth: lanes(|e| e.depth),
            quarter_inverse_depth: lanes(|e| e.quarter_inverse_depth),
            one_sided: lanes(|e| e.one_sided),
            isotropic: lanes(|e| e.isotropic),
            weight: lanes(|e| e.weight),
            everywhere: lanes(|e| e.everywhere),
            branch: entries.map(|entry| entry.branch),
        }
    }

    /// The emitter of a lane, without attenuation.
    #[inline(always)]
    pub(super) fn emitter(&self, lane: usize) -> Emitter {
        Emitter {
            center: Vec3::new(self.center[0][lane], self.center[1][lane], self.center[2][lane]),
            axis: Vec3::new(self.axis[0][lane], self.axis[1][lane], self.axis[2][lane]),
            radius: self.radius[lane],
            quarter_inverse_radius: self.quarter_inverse_radius[lane],
            depth: self.depth[lane],
            quarter_inverse_depth: self.quarter_inverse_depth[lane],
            one_sided: self.one_sided[lane],
            isotropic: self.isotropic[lane],
            weight: self.weight[lane],
            everywhere: self.everywhere[lane],
            ..Emitter::DARK
        }
    }

    /// Whether numbers read from a file can be those of a row.
    pub(super) fn is_sound(&self) -> bool {
        let Self {
            center,
            axis,
            radius,
            quarter_inverse_radius,
            depth,
            quarter_inverse_depth,
            one_sided,
            isotropic,
            weight,
            everywhere,
            branch: _,
        } = self;
        let amounts = [
            radius,
            quarter_inverse_radius,
            depth,
            quarter_inverse_depth,
            one_sided,
            isotropic,
            weight,
            everywhere,
        ];
        [center, axis]
            .iter()
            .all(|xyz| xyz.as_flattened().iter().all(|x| x.is_finite()))
            && amounts.iter().all(|lanes| lanes.iter().copied().all(is_amount))
    }
}

impl Attenuation {
    /// Of these entries.
    pub(super) fn of(entries: &[Weighed; LANES]) -> Self {
        let lanes = |value: fn(&Emitter) -> f32| entries.map(|entry| value(&entry.emitter));
        Self {
            cone_scale: lanes(|e| e.cone_scale),
            cone_offset: lanes(|e| e.cone_offset),
            inverse_range_sq: lanes(|e| e.inverse_range_sq),
        }
    }

    /// Attenuates the emitter of a lane.
    #[inline(always)]
    pub(super) fn attenuate(&self, lane: usize, emitter: &mut Emitter) {
        emitter.cone_scale = self.cone_scale[lane];
        emitter.cone_offset = self.cone_offset[lane];
        emitter.inverse_range_sq = self.inverse_range_sq[lane];
    }

    /// Whether numbers read from a file can be those of a row.
    pub(super) fn is_sound(&self) -> bool {
        let numbers = [self.cone_scale, self.cone_offset, self.inverse_range_sq];
        numbers.as_flattened().iter().all(|x| x.is_finite())
    }
}

impl Expected {
    /// Of these entries.
    pub(super) fn of(entries: &[Weighed; LANES]) -> Self {
        Self([0, 1, 2].map(|channel| entries.map(|entry| entry.expected[channel])))
    }

    /// Whether numbers read from a file can be what is expected.
    pub(super) fn is_sound(&self) -> bool {
        self.0.as_flattened().iter().copied().all(is_amount)
    }
}

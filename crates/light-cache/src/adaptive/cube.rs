//! Places within a cell, by the smallest cubes that it is cut into.

/// Of the smallest cubes there are 2 to this power along an edge of the cell.
pub(super) const LEVELS: u32 = 5;

/// Which of the smallest cubes of its cell a point is in.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Cube([u16; 3]);

impl Cube {
    /// By whole numbers of cubes along the axes, of which the lowest bits count.
    #[inline]
    pub(super) fn at(position: [i32; 3]) -> Self {
        Self(position.map(|c| c as u16 & ((1 << LEVELS) - 1)))
    }

    /// Which cube of a layer that is in, if the layer has 2^`bits` along an edge.
    #[inline]
    pub(super) fn within(self, bits: u32) -> usize {
        self.part(bits, bits)
    }

    /// The same, but counted in a cube around it that has 2^`step` of these along an edge.
    #[inline]
    pub(super) fn part(self, bits: u32, step: u32) -> usize {
        let [x, y, z] = self.0.map(|c| usize::from(c >> (LEVELS - bits)) & ((1 << step) - 1));
        x | y << step | z << (2 * step)
    }

    /// Whether it is one, if it was read from a file.
    pub(super) fn is_sound(self) -> bool {
        self.0.iter().all(|c| *c < 1 << LEVELS)
    }

    /// The cubes beside it in such a layer, as far as they are in the cell.
    pub(super) fn beside(self, bits: u32) -> impl Iterator<Item = Self> {
        let size = 1 << (LEVELS - bits);
        let moved = move |axis: usize, forward: bool| {
            let mut position = self.0;
            position[axis] = if forward {
                position[axis] + size
            } else {
                position[axis].checked_sub(size)?
            };
            (position[axis] < 1 << LEVELS).then_some(Self(position))
        };
        (0..3).flat_map(move |axis| {
            [false, true]
                .into_iter()
                .filter_map(move |forward| moved(axis, forward))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beside_a_cube_are_those_within_its_cell() {
        let beside = |position: [i32; 3]| Cube::at(position).beside(LEVELS).count();
        assert_eq!([[0, 0, 31], [3, 0, 7], [1, 2, 3]].map(beside), [3, 5, 6]);
    }
}

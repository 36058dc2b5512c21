//! Where light comes from around a cell: how paths that leave it go on.
//!
//! Of the light that arrives by way of other surfaces much comes from small parts of them, where a lamp shines close to a wall. What paths have found is
//! counted by part of the hemisphere, and later paths leave in proportion to its root mean square (second moments: Rath et al. 2020; learned in
//! epochs while rendering: Mueller, Gross and Novak 2017, Practical path guiding for efficient light-transport simulation). Differs: hashed cells, the same as those of
//! the lights, in place of a tree over space, and parts of the cosine-weighted hemisphere in place of a quadtree over the sphere, so that
//! directions are drawn in proportion to the product with the cosine and keep the strata of their random numbers. Places within a cell count
//! for themselves, with the whole cell as their prior.

use super::cube::Cube;
use crate::Bounce;
use crate::state::is_amount;
use sampling::HemisphereGuide;
use sampling::guide::PARTS;

/// Places along an edge of the cell: 2 to this power. Higher values follow light from near by; lower values learn faster.
const PLACES: u32 = 3;
/// Least density of a direction, relative to that of the cosine alone. Higher values bound the noise that wrong expectations make; lower values
/// follow them further.
const FLOOR: f32 = 0.2;
/// How many observations what is expected beforehand is worth in a part of the hemisphere.
const PRIOR_COUNT: f32 = 6.0;
/// Observations from which a place has a guide of its own. Higher values learn later; lower values follow chance.
const ENOUGH: f32 = 128.0;
/// Squares are counted as no more than this many times their mean so far, so that one path does not own a place. Statistics only: the
/// image is not clamped.
const SPIKE: f32 = 64.0;
/// No square is counted as more than this.
const LARGEST: f32 = 1e20;
/// Guides are made anew when so many times more was seen than when they were last made.
const REBUILD_GROWTH: f32 = 1.15;
/// No place yet.
const NONE: u16 = u16::MAX;

/// What was found in one part of the hemisphere.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
struct Seen {
    count: f32,
    /// Sum of the squared radiances.
    sum_sq: f32,
}

impl Seen {
    fn observe(&mut self, square: f32, times: f32) {
        self.count += times;
        self.sum_sq += times * square;
    }

    fn mean_sq(self) -> f32 {
        self.sum_sq / self.count.max(1.0)
    }

    fn is_sound(self) -> bool {
        is_amount(self.count) && is_amount(self.sum_sq)
    }
}

/// What was found by paths that left from around one place.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct Place {
    parts: Vec<Seen>,
    all: Seen,
    /// How much had been seen when the guide was last made.
    built_at: f32,
    guide: Option<HemisphereGuide>,
}

impl Place {
    fn new() -> Self {
        Self {
            parts: vec![Seen::default(); PARTS],
            all: Seen::default(),
            built_at: 0.0,
            guide: None,
        }
    }

    fn observe(&mut self, part: usize, square: f32, times: f32) {
        self.parts[part].observe(square, times);
        self.all.observe(square, times);
    }

    /// Mean square in every part, drawn to what was expected.
    fn means_sq(&self, expected: &[f32; PARTS]) -> [f32; PARTS] {
        std::array::from_fn(|part| {
            let seen = self.parts[part];
            (seen.sum_sq + PRIOR_COUNT * expected[part]) / (seen.count + PRIOR_COUNT)
        })
    }

    /// Makes the guide anew if enough was seen that is new.
    fn refresh(&mut self, expected: &[f32; PARTS]) {
        if self.all.count >= ENOUGH && self.all.count >= REBUILD_GROWTH * self.built_at {
            self.built_at = self.all.count;
            self.guide = HemisphereGuide::new(&self.means_sq(expected).map(f32::sqrt), FLOOR);
        }
    }

    fn is_sound(&self) -> bool {
        self.parts.len() == PARTS
            && self.parts.iter().all(|seen| seen.is_sound())
            && self.all.is_sound()
            && is_amount(self.built_at)
            && self.guide.as_ref().is_none_or(HemisphereGuide::is_sound)
    }

    fn bytes(&self) -> usize {
        size_of::<Self>() + self.parts.capacity() * size_of::<Seen>()
    }
}

/// All that is known of directions in a cell.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Directions {
    whole: Place,
    /// Number of the [`Place`] of each cube.
    numbers: Vec<u16>,
    places: Vec<Place>,
}

impl Directions {
    /// Nothing known yet.
    pub(super) fn new() -> Self {
        Self {
            whole: Place::new(),
            numbers: vec![NONE; 1 << (3 * PLACES)],
            places: Vec::new(),
        }
    }

    /// How many places anything was found from.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// Takes note, `times` times, of what a path found that left from `cube`. Places are made where they are missing, if they `may_grow` in number.
    pub(super) fn observe(&mut self, cube: Cube, bounce: Bounce, times: f32, may_grow: bool) {
        let part = usize::from(bounce.part);
        let most = if self.whole.all.count >= ENOUGH {
            LARGEST.min(SPIKE * self.whole.all.mean_sq())
        } else {
            LARGEST
        };
        let square = (bounce.radiance * bounce.radiance).min(most);
        self.whole.observe(part, square, times);
        let number = &mut self.numbers[cube.within(PLACES)];
        if *number == NONE {
            if !may_grow {
                return;
            }
            *number = self.places.len() as u16;
            self.places.push(Place::new());
        }
        self.places[usize::from(*number)].observe(part, square, times);
    }

    /// Makes guides anew where enough was seen that is new.
    pub(super) fn refresh(&mut self) {
        let even = [self.whole.all.mean_sq(); PARTS];
        self.whole.refresh(&even);
        let around = self.whole.means_sq(&even);
        for place in &mut self.places {
            place.refresh(&around);
        }
    }

    /// For paths that leave from `cube`; `None` before anything is known.
    #[inline]
    pub(super) fn guide(&self, cube: Cube) -> Option<&HemisphereGuide> {
        let place = self.places.get(usize::from(self.numbers[cube.within(PLACES)]));
        place
            .and_then(|place| place.guide.as_ref())
            .or(self.whole.guide.as_ref())
    }

    /// For paths that leave from where no place has a guide of its own.
    pub(super) fn of_whole_cell(&self) -> Option<&HemisphereGuide> {
        self.whole.guide.as_ref()
    }

    /// The guides of places, each with the number of its cube.
    pub(super) fn of_places(&self) -> impl Iterator<Item = (u32, &HemisphereGuide)> {
        let numbered = (0..).zip(&self.numbers);
        numbered.filter_map(|(cube, &number)| Some((cube, self.places.get(usize::from(number))?.guide.as_ref()?)))
    }

    /// Whether it can be what was learned in a cell.
    pub(super) fn is_sound(&self) -> bool {
        let numbered = |&number: &u16| number == NONE || usize::from(number) < self.places.len();
        self.whole.is_sound()
            && self.numbers.len() == 1 << (3 * PLACES)
            && self.numbers.iter().all(numbered)
            && self.places.iter().all(Place::is_sound)
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let places = self.places.iter().map(Place::bytes).sum::<usize>();
        size_of::<Self>() + self.numbers.capacity() * size_of::<u16>() + self.whole.bytes() + places
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use sampling::guide::part_of;

    #[test]
    fn paths_leave_where_light_was_found() {
        let (lit, dark) = (Cube::at([0, 0, 0]), Cube::at([15, 0, 0]));
        let bright = part_of(Vec3::Z, Vec3::new(0.6, 0.0, 0.8));
        let mut directions = Directions::new();
        assert!(directions.guide(lit).is_none());
        for round in 0..40 {
            for part in 0..PARTS {
                for (cube, found) in [(lit, if part == bright { 10.0 } else { 0.1 }), (dark, 1.0)] {
                    let bounce = Bounce {
                        part: part as u16,
                        radiance: found,
                    };
                    directions.observe(cube, bounce, 1.0, round > 0);
                }
            }
            directions.refresh();
        }
        let density = |cube, direction| {
            directions
                .guide(cube)
                .expect("enough was seen")
                .density(Vec3::Z, direction)
        };
        let (there, elsewhere) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.6, 0.0, 0.8));
        assert!(density(lit, there) > 10.0 && density(lit, elsewhere) < 0.8);
        assert!(density(dark, there) < 3.0 && density(dark, elsewhere) > 0.8);
        assert!(density(lit, elsewhere) >= FLOOR);
        assert!(directions.is_sound());
        assert_eq!(directions.len(), 2);
    }

    #[test]
    fn no_path_teaches_what_cannot_be_counted() {
        let mut directions = Directions::new();
        for part in 0..1000 {
            let bounce = Bounce {
                part: part % PARTS as u16,
                radiance: if part % 3 == 0 { f32::MAX } else { 0.0 },
            };
            directions.observe(Cube::at([1, 2, 3]), bounce, 1e6, true);
        }
        directions.refresh();
        assert!(directions.is_sound());
        assert!(directions.guide(Cube::at([1, 2, 3])).is_some());
    }
}

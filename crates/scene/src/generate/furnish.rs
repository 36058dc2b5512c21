//! What stands where in a room.

use super::builder::{Builder, Pose};
use super::building::{Room, SIDES, Side};
use super::dice::Dice;
use super::fixtures::Spots;
use super::furniture::{self as piece, Palette};
use glam::{Vec2, Vec3};

/// What a room is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// The living room that the camera stands in.
    Hero,
    Living,
    Dining,
    Study,
    Library,
    Bedroom,
    Gallery,
}

impl Kind {
    pub(super) const ORDINARY: [Self; 6] = [
        Self::Living,
        Self::Dining,
        Self::Study,
        Self::Library,
        Self::Bedroom,
        Self::Gallery,
    ];
}

/// Places pieces in a room so that they neither meet nor stand in a doorway.
struct Furnisher<'a> {
    b: &'a mut Builder,
    dice: &'a mut Dice,
    palette: &'a Palette,
    room: &'a Room,
    index: usize,
    count: u32,
    /// Where the last piece was put.
    pose: Pose,
    /// What a lamp may hang over.
    table: Option<Pose>,
    /// Where a lamp may stand.
    floor: Option<Vec3>,
    /// Taken floor, (low, high) in world (x, z).
    taken: Vec<(Vec2, Vec2)>,
    /// Taken wall: side, from, to.
    hung: Vec<(Side, f32, f32)>,
}

/// Furnishes `room`; tells where lamps may go.
pub(super) fn furnish<'a>(
    b: &mut Builder,
    dice: &mut Dice,
    palette: &Palette,
    room: &'a Room,
    index: usize,
    kind: Kind,
) -> Spots<'a> {
    let mut taken = Vec::new();
    let mut hung = Vec::new();
    for side in SIDES {
        if let Some(door) = room.opening(side) {
            let half = 0.5 * door.width + 0.12;
            hung.push((side, door.center - half, door.center + half));
            taken.push(footprint(&room.at_wall(side, door.center), half, 0.0, 0.95));
        }
    }
    let mut f = Furnisher {
        b,
        dice,
        palette,
        room,
        index,
        count: 0,
        pose: Pose::IDENTITY,
        table: None,
        floor: None,
        taken,
        hung,
    };
    match kind {
        Kind::Hero => f.hero(),
        Kind::Living => f.living(),
        Kind::Dining => f.dining(),
        Kind::Study => f.study(),
        Kind::Library => f.library(),
        Kind::Bedroom => f.bedroom(),
        Kind::Gallery => f.gallery(),
    }
    Spots {
        room,
        index,
        kind,
        table: f.table,
        floor: f.floor,
    }
}

/// The rectangle on the floor that a piece of half width `half` and from `near` to `far` in front of its pose covers.
fn footprint(pose: &Pose, half: f32, near: f32, far: f32) -> (Vec2, Vec2) {
    let corners = [(-half, near), (half, near), (-half, far), (half, far)].map(|(x, z)| {
        let at = pose.point(Vec3::new(x, 0.0, z));
        Vec2::new(at.x, at.z)
    });
    corners
        .iter()
        .fold((corners[0], corners[0]), |(low, high), &c| (low.min(c), high.max(c)))
}

impl Furnisher<'_> {
    fn begin(&mut self, what: &str) {
        self.b
            .begin(format!("room {} / {what} {}", self.index, self.count), what);
        self.count += 1;
    }

    fn free(&self, (low, high): (Vec2, Vec2)) -> bool {
        let room = self.room;
        let inside = low.x >= room.low.x - 0.01
            && low.y >= room.low.z - 0.01
            && high.x <= room.high.x + 0.01
            && high.y <= room.high.z + 0.01;
        inside
            && self
                .taken
                .iter()
                .all(|&(l, h)| low.x >= h.x || high.x <= l.x || low.y >= h.y || high.y <= l.y)
    }

    /// Puts a piece of this width and depth at a wall, if a place is found; `tall` keeps paintings away.
    fn at_wall(&mut self, what: &str, width: f32, depth: f32, tall: bool) -> bool {
        for _ in 0..10 {
            let side = self.dice.pick(&SIDES);
            let length = self.room.length(side);
            if length < width + 0.1 {
                continue;
            }
            let along = self.dice.range(0.5 * width + 0.04, length - 0.5 * width - 0.04);
            let pose = self.room.at_wall(side, along);
            let area = footprint(&pose, 0.5 * width + 0.04, 0.0, depth);
            if self.free(area) {
                self.stand(what, pose, area, tall.then_some((side, along, width)));
                return true;
            }
        }
        false
    }

    fn stand(&mut self, what: &str, pose: Pose, area: (Vec2, Vec2), tall: Option<(Side, f32, f32)>) {
        self.taken.push(area);
        if let Some((side, along, width)) = tall {
            self.hung.push((side, along - 0.5 * width, along + 0.5 * width));
        }
        self.begin(what);
        self.pose = pose;
        self.b.place(pose);
    }

    fn painting(&mut self) {
        for _ in 0..8 {
            let side = self.dice.pick(&SIDES);
            let size = self.dice.pick(&[[1.2, 0.8], [0.7, 0.9], [0.9, 0.9]]);
            let length = self.room.length(side);
            let along = self.dice.range(0.5 * size[0] + 0.2, length - 0.5 * size[0] - 0.2);
            let (from, to) = (along - 0.5 * size[0] - 0.1, along + 0.5 * size[0] + 0.1);
            if self
                .hung
                .iter()
                .all(|&(s, low, high)| s != side || from >= high || to <= low)
            {
                self.paint_at(side, along, size);
                return;
            }
        }
    }

    fn paint_at(&mut self, side: Side, along: f32, size: [f32; 2]) {
        self.hung.push((side, along - 0.5 * size[0], along + 0.5 * size[0]));
        self.begin("painting");
        self.b.place(self.room.at_wall(side, along));
        piece::painting(self.b, self.dice, self.palette, size);
    }

    fn plant(&mut self, corner: bool) {
        let size = self.room.size();
        for _ in 0..8 {
            let margin = 0.42;
            let (x, z) = if corner {
                (
                    self.dice.pick(&[margin, size.x - margin]),
                    self.dice.pick(&[margin, size.y - margin]),
                )
            } else {
                (
                    self.dice.range(margin, size.x - margin),
                    self.dice.range(margin, size.y - margin),
                )
            };
            let at = self.room.low + Vec3::new(x, 0.0, z);
            let area = (Vec2::new(at.x - 0.3, at.z - 0.3), Vec2::new(at.x + 0.3, at.z + 0.3));
            if self.free(area) {
                self.stand(
                    "plant",
                    Pose {
                        origin: at,
                        ..Pose::IDENTITY
                    },
                    area,
                    None,
                );
                let height = self.dice.range(0.9, 1.6);
                piece::plant(self.b, self.dice, self.palette, height, 12);
                return;
            }
        }
    }

    /// Keeps the floor of a corner free for a lamp.
    fn keep_lamp_corner(&mut self) {
        let size = self.room.size();
        for _ in 0..8 {
            let margin = 0.3;
            let (x, z) = (
                self.dice.pick(&[margin, size.x - margin]),
                self.dice.pick(&[margin, size.y - margin]),
            );
            let at = self.room.low + Vec3::new(x, 0.0, z);
            let area = (Vec2::new(at.x - 0.25, at.z - 0.25), Vec2::new(at.x + 0.25, at.z + 0.25));
            if self.free(area) {
                self.taken.push(area);
                self.floor = Some(at);
                return;
            }
        }
    }

    fn shelf(&mut self, width: f32, fill: f32) {
        if self.at_wall("shelf", width, 0.32, true) {
            let wood = self
                .dice
                .pick(&[self.palette.oak, self.palette.walnut, self.palette.white]);
            let height = self.dice.pick(&[1.2, 2.0]);
            piece::shelf(self.b, self.dice, self.palette, [width, height], wood, fill);
        }
    }

    fn sideboard(&mut self) {
        if self.at_wall("sideboard", 1.6, 0.5, false) {
            let wood = self.dice.pick(&[self.palette.oak, self.palette.walnut]);
            piece::sideboard(self.b, self.dice, self.palette, 1.6, wood);
        }
    }

    /// A rug in the middle of the room, and what stands on it.
    fn middle(&mut self) -> Vec3 {
        let center = self.room.center();
        let half = (0.27 * self.room.size()).min(Vec2::new(1.5, 1.1));
        let field = self.dice.pick(&self.palette.fabric);
        let border = self
            .dice
            .pick(&[self.palette.linen, self.palette.fabric[4], self.palette.fabric[2]]);
        self.begin("rug");
        self.b.place(Pose {
            origin: center,
            ..Pose::IDENTITY
        });
        piece::rug(self.b, [half.x, half.y], field, border);
        self.taken.push((
            Vec2::new(center.x, center.z) - half,
            Vec2::new(center.x, center.z) + half,
        ));
        center
    }

    fn living(&mut self) {
        self.keep_lamp_corner();
        let center = self.middle();
        let fabric = self.dice.pick(&self.palette.fabric);
        self.begin("coffee table");
        self.b.place(Pose {
            origin: center + Vec3::Y * 0.011,
            ..Pose::IDENTITY
        });
        piece::round_table(self.b, 0.45, 0.42, self.palette.oak, self.palette.dark);
        piece::stack(self.b, self.dice, self.palette, Vec3::new(0.1, 0.42, 0.05));
        if self.at_wall("sofa", 2.1, 0.95, false) {
            piece::sofa(self.b, self.dice, self.palette, 2.1, fabric);
        }
        if self.at_wall("armchair", 1.1, 0.95, false) {
            piece::sofa(self.b, self.dice, self.palette, 1.1, fabric);
        }
        self.sideboard();
        self.shelf(1.2, 0.7);
        self.plant(true);
        self.painting();
        self.painting();
    }

    fn dining(&mut self) {
        let center = self.middle();
        let turns = if self.room.size().y > self.room.size().x {
            0.25
        } else {
            0.0
        };
        self.begin("dining table");
        piece::dining_group(self.b, self.dice, self.palette, center + Vec3::Y * 0.011, turns, 2);
        self.table = Some(Pose::new(center, turns));
        self.sideboard();
        self.plant(true);
        self.plant(true);
        self.painting();
        self.painting();
    }

    fn study(&mut self) {
        if self.at_wall("desk", 1.6, 1.35, true) {
            piece::desk(self.b, self.dice, self.palette);
            // Someone sits at it: the chair looks at the wall.
            let seat = self.dice.pick(&self.palette.fabric);
            let at = self.pose.point(Vec3::new(0.0, 0.0, 0.95));
            self.b.place(Pose {
                origin: at,
                x_axis: -self.pose.x_axis,
            });
            piece::chair(self.b, self.palette.dark, seat);
        }
        self.middle();
        self.shelf(1.6, 0.8);
        self.shelf(1.0, 0.6);
        self.plant(true);
        self.painting();
    }

    fn library(&mut self) {
        self.keep_lamp_corner();
        for _ in 0..3 {
            self.shelf(1.8, 0.9);
        }
        self.middle();
        let fabric = self.dice.pick(&self.palette.fabric);
        if self.at_wall("armchair", 1.1, 0.95, false) {
            piece::sofa(self.b, self.dice, self.palette, 1.1, fabric);
        }
        self.plant(true);
    }

    fn bedroom(&mut self) {
        self.keep_lamp_corner();
        if self.at_wall("bed", 1.8, 2.2, false) {
            piece::bed(self.b, self.dice, self.palette);
        }
        self.sideboard();
        self.shelf(0.9, 0.5);
        self.plant(true);
        self.painting();
        self.painting();
    }

    fn gallery(&mut self) {
        for _ in 0..3 {
            let size = self.room.size();
            let at = self.room.low
                + Vec3::new(
                    self.dice.range(0.6, size.x - 0.6),
                    0.0,
                    self.dice.range(0.6, size.y - 0.6),
                );
            let area = (Vec2::new(at.x - 0.4, at.z - 0.4), Vec2::new(at.x + 0.4, at.z + 0.4));
            if self.free(area) {
                self.stand(
                    "pedestal",
                    Pose {
                        origin: at,
                        ..Pose::IDENTITY
                    },
                    area,
                    None,
                );
                piece::pedestal(self.b, self.dice, self.palette);
            }
        }
        for _ in 0..6 {
            self.painting();
        }
    }

    /// The room in the foreground is composed by hand for its camera.
    fn hero(&mut self) {
        let p = self.palette;
        let (low, high) = (self.room.low, self.room.high);
        let at = |x: f32, z: f32| Vec3::new(low.x + x, low.y, low.z + z);
        self.begin("rug");
        self.b.place(Pose {
            origin: at(2.5, 3.1),
            ..Pose::IDENTITY
        });
        piece::rug(self.b, [1.6, 1.25], p.linen, p.fabric[4]);
        self.begin("coffee table");
        self.b.place(Pose {
            origin: at(2.45, 3.1) + Vec3::Y * 0.011,
            ..Pose::IDENTITY
        });
        piece::round_table(self.b, 0.5, 0.42, p.oak, p.dark);
        piece::stack(self.b, self.dice, p, Vec3::new(0.14, 0.42, 0.1));
        piece::vase(self.b, Vec3::new(-0.15, 0.42, -0.12), 0.26, p.clay);
        self.begin("sofa");
        self.b.place(self.room.at_wall(Side::NegX, 3.2));
        piece::sofa(self.b, self.dice, p, 2.3, p.fabric[0]);
        self.begin("armchair");
        self.b.place(Pose::new(at(2.2, 0.75), 0.03));
        piece::sofa(self.b, self.dice, p, 1.0, p.fabric[1]);
        self.table = Some(Pose::new(at(2.45, 3.1), 0.0));
        self.floor = Some(at(0.3, 1.9));
        self.begin("shelf");
        self.b.place(self.room.at_wall(Side::NegZ, 1.55));
        piece::shelf(self.b, self.dice, p, [1.9, 2.1], p.walnut, 0.75);
        self.begin("sideboard");
        self.b.place(self.room.at_wall(Side::PosX, 2.0));
        piece::sideboard(self.b, self.dice, p, 1.8, p.oak);
        self.begin("plant");
        self.b.place(Pose {
            origin: at(high.x - low.x - 0.75, 0.55),
            ..Pose::IDENTITY
        });
        piece::plant(self.b, self.dice, p, 1.55, 22);
        self.paint_at(Side::NegX, 3.2, [1.4, 0.85]);
        self.paint_at(Side::PosX, 2.0, [0.8, 0.8]);
    }
}

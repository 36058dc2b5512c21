//! What loading found, ignored and skipped: nothing is dropped in silence.

use std::collections::BTreeMap;

/// The load report: printed by `info`, and as warnings by the other commands.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct Report {
    /// What the file asks for and this renderer does not do, with how often: ("KHR_materials_transmission", 3).
    pub ignored: BTreeMap<String, u64>,
    /// Things that were repaired or are odd ("material 'lamp': emission NaN, set to 0").
    pub warnings: Vec<String>,
    /// What the scene does not need, so that it costs nothing ("no textures: no texture lookups").
    pub skipped: Vec<String>,
}

impl Report {
    /// Counts one more use of an unsupported feature.
    pub fn ignore(&mut self, what: impl Into<String>) {
        *self.ignored.entry(what.into()).or_default() += 1;
    }

    /// Notes something repaired or odd; at most 100 are kept, the rest counted under `ignored`.
    pub fn warn(&mut self, what: impl Into<String>) {
        if self.warnings.len() < 100 {
            self.warnings.push(what.into());
        } else {
            self.ignore("further warnings");
        }
    }
}

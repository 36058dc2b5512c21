//! What the cross-crate tests share: hand-made scenes, renderings repeated over seeds, and the comparisons that decide.
//!
//! Every comparison is a statistical test with a stated rate of false alarms; all seeds are fixed, so a test that has
//! passed once passes always on the same code.

pub mod compare;
pub mod scenes;

pub use compare::{Case, Measured, Plan, assert_same};

//! What mechanisms charge for: told in the account kind by kind.

use crate::market::{ChargeKind, Execution};
use crate::sim2real::Mechanism;

use super::CHARGING;

/// A mechanism that charges for what is held: a row of [`CHARGING`], beside its row in the registry.
pub trait Charging: Mechanism<Execution> {
    /// What for.
    fn kind(&self) -> ChargeKind;
}

/// What the mechanism of that id charges for; [`ChargeKind::Other`] where it does not say.
#[must_use]
pub fn charge_kind(id: &str) -> ChargeKind {
    CHARGING.iter().find(|mechanism| mechanism.about().name == id).map_or(ChargeKind::Other, |mechanism| mechanism.kind())
}

//! Twins of the model `cart_pole`.

use std::path::PathBuf;

use super::{
    Columns, LONGEST_SPACING, Must, Wanted, channel, check_channels, check_model, check_no_step, parameters, read, seen,
};
use crate::io::{InputError, TwinFile};
use crate::robot::{CART_POLE_MECHANISMS, CartPole, Commands};
use crate::sim2real::{Assembly, Recording};

/// Standard gravity [m/s^2] (3rd General Conference on Weights and Measures, 1901), rounded.
const GRAVITY: f64 = 9.81;

/// The cart-pole a twin describes, with what it models already.
///
/// # Errors
/// As [`joint_assembly`](super::joint_assembly).
pub fn cart_pole_assembly(twin: &TwinFile) -> Result<Assembly<CartPole>, InputError> {
    check_model(twin, "cart_pole")?;
    check_no_step(twin)?;
    let wanted = CartPole::parameter_names().map(|(name, unit)| {
        let (must, default) = match name {
            "cart_mass" | "pole_mass" | "half_length" => (Must::BePositive, None),
            "gravity" => (Must::BePositive, Some(GRAVITY)),
            "gain" => (Must::NotBeZero, Some(1.0)),
            _ => (Must::NotBeNegative, Some(0.0)),
        };
        Wanted { name, unit: unit.to_owned(), must: Some(must), default }
    });
    let (values, uncertainty) = parameters(twin, "a cart-pole", &wanted)?;
    super::assembly(twin, CartPole::new(values, uncertainty), CART_POLE_MECHANISMS)
}

/// The recordings at `paths`, their columns as the twin's channels say: a command, the cart's position and the pole's angle,
/// and their rates where they were measured.
///
/// # Errors
/// As [`joint_recordings`](super::joint_recordings).
pub fn cart_pole_recordings(twin: &TwinFile, paths: &[PathBuf]) -> Result<Vec<Recording<Commands>>, InputError> {
    let units = [("position", "m"), ("velocity", "m/s"), ("angle", "rad"), ("angular_velocity", "rad/s")];
    let known: Vec<&str> = ["command"].into_iter().chain(units.map(|(name, _)| name)).collect();
    check_channels(twin, "a cart-pole", &known)?;
    let command = ("command".to_owned(), channel(twin, "command")?.column.clone());
    for needed in ["position", "angle"] {
        channel(twin, needed)?;
    }
    let columns = Columns { driving: vec![command], seen: seen(twin, &units)?, longest_spacing: Some(LONGEST_SPACING) };
    paths.iter().map(|path| Ok(read(path, &columns)?.commanded())).collect()
}

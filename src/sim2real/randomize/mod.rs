//! Domain randomization: what a policy is trained on, varied as the real thing may differ.

pub mod image;

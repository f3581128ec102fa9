//! What moves: its mechanisms, environments of robots, and diagnoses of recordings.

mod arm_scene;
mod closed_loop;
mod counted;
mod diagnose;
mod engines;
mod env;
mod garbage;
mod identify;
mod joint_input;
mod lanes;
mod mechanisms;
mod once_in_free_run;
mod once_misjudged;
mod once_wrong;
mod processes;
mod rates_of_readings;
mod r#where;

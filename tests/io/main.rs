//! Files, and what is said of bad ones.

#![cfg(feature = "io")]

mod bad_documents;
mod bad_input;
mod chunks;
mod columnar;
mod data_keys;
mod data_layouts;
mod data_rules;
mod data_streams;
mod history_file;
mod paper_log_faults;
mod paper_logs;
mod paper_scene;
mod reader_seeds;
mod scene;

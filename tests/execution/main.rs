//! What execution does to orders: its laws, and diagnoses of logs in which they are concealed.

mod capped_logs;
mod draws;
mod impact;
mod log_clocks;
mod once_wrong;
mod plant;
mod queued_logs;
mod tape_orders;
mod twin;

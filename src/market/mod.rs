//! Markets: what is traded, the backtest that trades it, and `execution`, the plant every order meets.

mod account;
#[cfg(feature = "io")]
mod account_file;
mod agenda;
mod audit;
mod backtest;
mod bar;
mod blotter;
mod book;
mod booking;
mod by_id;
mod calendar;
mod carry;
mod censored;
mod check;
mod checkpoint;
mod corporate_action;
mod covariate;
mod daily;
mod data_notes;
mod data_summary;
mod decimal;
mod depth;
mod depth_book;
#[cfg(feature = "io")]
mod depth_quotes;
mod desk;
#[cfg(feature = "io")]
mod draw_page;
#[cfg(feature = "io")]
mod draws;
pub mod env;
mod equity_curve;
mod execution;
mod feed;
mod following;
mod foresight;
mod halt;
mod history;
#[cfg(feature = "io")]
mod history_file;
mod hours;
pub mod indicator;
mod instrument;
mod known;
mod latency;
mod ledger;
mod line;
#[cfg(feature = "io")]
mod listed;
mod log_clock;
mod log_entry;
#[cfg(feature = "io")]
mod log_folder;
mod log_rows;
#[cfg(feature = "io")]
mod log_split;
mod look;
mod mail;
mod margin_call;
pub mod mechanism;
mod met_by_report;
pub mod metric;
mod money;
mod order;
mod order_log;
mod own_print;
pub mod paper;
#[cfg(feature = "io")]
pub mod paper_run;
mod past;
#[cfg(feature = "io")]
mod preset;
mod price_assumption;
mod price_scatter;
mod quantum;
mod queue_place;
mod quote;
mod rates;
mod reason;
mod recent;
pub mod reconcile;
mod redraws;
pub mod response;
mod reversal;
mod row_check;
#[cfg(feature = "io")]
mod run;
#[cfg(feature = "io")]
mod run_as_twin;
#[cfg(feature = "io")]
mod run_beside;
#[cfg(feature = "io")]
mod run_calendar;
#[cfg(feature = "io")]
mod run_figures;
#[cfg(feature = "io")]
mod run_halts;
#[cfg(feature = "io")]
mod run_log;
#[cfg(feature = "io")]
mod run_needs;
#[cfg(feature = "io")]
mod run_page;
#[cfg(feature = "io")]
mod run_stream;
mod session;
mod shown_age;
mod sources;
mod spare;
mod strategy;
mod stream;
#[cfg(feature = "io")]
pub mod sweep;
mod tape;
#[cfg(feature = "io")]
mod tape_file;
pub mod tape_orders;
#[cfg(feature = "io")]
mod tapes;
mod ticket;
mod time_index;
mod transit;
#[cfg(feature = "io")]
mod twin;
mod venue;
mod volatility_regime;
#[cfg(feature = "io")]
pub mod walk_forward;

pub use account::{Account, AccountRecord, ActionKind, BookedAction, CorporateAction, MarginCall, Rate};
pub use audit::{
    Audit, AuditSettings, AuditVerdict, Change, Cut, Difference, Engine, FillFault, Impossible, KnownEarly, Subject, audit,
    audit_engine,
};
pub use backtest::{Backtest, BacktestError, DataSeen, EquityPoint, Held, Record, Settings};
pub use bar::Bar;
pub use blotter::{Blotter, Fill, FillCost, Order, Rejection, Sender, Status, Why};
pub use book::{Book, Level, Walk};
pub use calendar::{
    Calendar, CalendarError, CalendarFault, CalendarTable, Day, Hours, LocalTime, Observed, OccasionRow, SessionRow, Trading,
};
pub use check::{check_strategy, check_strategy_on};
pub use checkpoint::{AnotherFill, Checkpoint, ForkError, Moment};
pub use daily::Daily;
pub use data_notes::{DataNotes, Finding, Treatment};
pub use data_summary::DataSummary;
pub use decimal::{DecimalError, Rounded};
pub use depth::{DepthAction, DepthChange, OrderAction, OrderEvent};
pub use depth_book::DepthBook;
#[cfg(feature = "io")]
pub use draws::{DrawOutcome, DrawnRun, DrawsSummary, RunDraws};
pub use env::ENVIRONMENTS;
pub use execution::{Executed, Execution, ExecutionEffect, Met, Report, cost_bps, fee_bps};
pub use feed::{Arrival, Feed};
pub use foresight::Foresight;
pub use halt::{Halt, HaltSeen, HaltSummary, UnderHalt, WhileHalted};
pub use history::{History, HistoryError};
pub use instrument::Instrument;
pub use known::OpenOrder;
pub use latency::{Latencies, Latency, LatencyError, Strain};
pub use ledger::{
    Balance, ChargeKind, Charges, Closing, Conversion, Dividend, Fraction, Income, Ledger, LedgerError, Margin, Multiplier,
    Position, Requirement, Split, Terms, Trade,
};
pub use log_entry::{LogError, LogTable, LoggedFill, LoggedOrder, OrderType};
#[cfg(feature = "io")]
pub use log_folder::LogReader;
pub use mechanism::MECHANISMS;
pub use money::{Cash, Increments, MoneyError, Price, Quantity};
pub use order::{InFlight, Posted, Role, Side};
pub use order_log::{LogMarket, OrderLog};
pub use own_print::{Piece, ShownDelay, own_print};
#[cfg(feature = "io")]
pub use preset::presets as market_presets;
pub use price_assumption::PriceAssumption;
pub use quote::{Quote, QuoteSlice, Quotes};
pub use reason::Reason;
#[cfg(feature = "io")]
pub use run::{PreparedRun, explained, prepare_run};
#[cfg(feature = "io")]
pub use run_as_twin::settle_trued_run;
#[cfg(feature = "io")]
pub use run_log::{InputFile, OutputError, Provenance, RunBrief, RunOutputs, RunSummary};
#[cfg(feature = "io")]
pub use run_stream::{prepare_streaming_run, streams_as_well};
pub use session::Session;
pub use sources::Sources;
pub use strategy::{Event, EventKind, News, Notice, Orders, Strategy, View};
#[cfg(feature = "io")]
pub use stream::FileStream;
pub use stream::{Dated, Departure, Known, NumberedPrint, OrderStep, Stored, Stream, StreamError};
pub use tape::{Print, Seen, Tape};
#[cfg(feature = "io")]
pub use tape_file::{TapeFiles, read_tape};
pub use ticket::{Bracket, Condition, Link, OrderId, OrderKind, Request, Ticket, TimeInForce};
#[cfg(feature = "io")]
pub use twin::{check_needs, execution_assembly, execution_logs, execution_twin};
pub use venue::{Intrabar, LimitFill, Matching, QueueModel, Reference};

//! The extension module `trueup._trueup`: the library as Python calls it. The package `trueup` puts names and documentation around it.
//!
//! Whatever takes long runs without Python's lock, on a thread of its own, and ends where Ctrl-C is pressed ([`work`]). Errors become
//! exceptions ([`error`]); a panic is one too.

mod about;
mod backtest;
mod bound;
mod command;
mod environment;
mod error;
mod fresh;
mod initial;
mod options;
mod orders;
mod simulator;
mod strategy;
mod table;
mod view;
mod work;

use pyo3::prelude::*;

#[pymodule]
fn _trueup(module: &Bound<'_, PyModule>) -> PyResult<()> {
    // A panic is raised as an exception, or caught where a reader meets corrupt bytes; someone who asks for a backtrace gets all.
    if std::env::var_os("RUST_BACKTRACE").is_none_or(|value| value == "0") {
        std::panic::set_hook(Box::new(|_| {}));
    }
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(command::main, module)?)?;
    module.add_function(wrap_pyfunction!(command::answer, module)?)?;
    module.add_function(wrap_pyfunction!(backtest::backtest, module)?)?;
    module.add_function(wrap_pyfunction!(backtest::backtest_with, module)?)?;
    module.add_function(wrap_pyfunction!(backtest::audit_with, module)?)?;
    module.add_function(wrap_pyfunction!(table::columns_of, module)?)?;
    module.add_function(wrap_pyfunction!(table::read_columns, module)?)?;
    module.add_function(wrap_pyfunction!(table::write_columns, module)?)?;
    module.add_function(wrap_pyfunction!(environment::environments, module)?)?;
    module.add_class::<environment::Lanes>()?;
    module.add_class::<bound::BoundLanes>()?;
    module.add_class::<table::Table>()?;
    module.add_class::<backtest::Outputs>()?;
    module.add_class::<view::Sight>()?;
    module.add_class::<view::Bars>()?;
    module.add_class::<orders::OrderBook>()?;
    module.add_class::<simulator::ScriptedSimulator>()
}

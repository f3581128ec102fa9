//! The figures of a backtest as its report shows them.

use crate::report::quantity::{decimals, fine, number, percent, significant, span, with_unit};
use crate::report::{FigureGroup, Metric};

use super::RunSummary;
use super::metric::{Metrics, Returns};

/// The figures that come first.
pub(super) fn key_figures(summary: &RunSummary) -> Vec<Metric> {
    let told = Told { summary };
    vec![
        told.total_return(),
        told.final_equity(),
        told.cagr(),
        told.sharpe(),
        told.volatility(),
        told.max_drawdown(),
        told.turnover(),
        told.exposure(),
        told.round_trips(),
        told.costs(),
        told.costs_bps(),
        told.fills(),
    ]
}

/// All figures, by what they are about.
pub(super) fn figure_groups(summary: &RunSummary) -> Vec<FigureGroup> {
    let told = Told { summary };
    let group = |title: &str, figures: Vec<Metric>| FigureGroup { title: title.to_owned(), figures };
    let mut groups = vec![
        group("Return", told.of_return()),
        group("Risk", told.of_risk()),
        group("Trading", told.of_trading()),
        group("Costs", told.of_costs()),
    ];
    let account = account_figures(summary);
    if !account.is_empty() {
        groups.push(group("Account", account));
    }
    groups
}

/// What came and went without a trade, and what there is of each currency; nothing where that is cash alone.
fn account_figures(summary: &RunSummary) -> Vec<Metric> {
    let (counts, several) = (&summary.counts, summary.account.len() > 1);
    let mut figures = Vec::new();
    for of in &summary.account {
        let money = |amount: f64| Some(with_unit(&decimals(amount, 2), &of.currency));
        let mut add = |name: &str, amount: f64, help: &str| {
            if amount != 0.0 {
                figures.push(figure(name, money(amount), help));
            }
        };
        if several {
            add(&format!("Cash in {}", of.currency), of.cash, "At the end; below 0 where it is owed.");
        }
        add("Dividends", of.dividends, "Before tax; those paid when short are subtracted.");
        add("Tax withheld", of.withheld, "From dividends of long positions.");
        add("Borrow fees", of.charges.borrow, "Charged on what was sold short.");
        add("Funding", of.charges.funding, "Of perpetual futures; below 0 where it was received.");
        add("Interest", of.charges.interest, "On cash; below 0 where it was received.");
        add("Other charges", of.charges.other, "On what was held.");
    }
    if counts.margin_calls > 0 {
        let calls = Some(decimals(counts.margin_calls as f64, 0));
        let help = format!("Equity fell below maintenance; the broker sent {} orders.", counts.broker_orders);
        figures.push(figure("Margin calls", calls, help));
    }
    figures
}

/// A figure: its name, its value where it is defined, and what it is.
fn figure(name: &str, value: Option<String>, help: impl Into<String>) -> Metric {
    Metric { name: name.to_owned(), value, help: help.into() }
}

/// A summary that is told figure by figure.
struct Told<'a> {
    summary: &'a RunSummary,
}

impl Told<'_> {
    fn metrics(&self) -> &Metrics {
        &self.summary.metrics
    }

    fn money(&self, amount: f64) -> String {
        with_unit(&decimals(amount, 2), &self.summary.provenance.currency)
    }

    fn maybe_money(&self, amount: Option<f64>) -> Option<String> {
        amount.map(|amount| self.money(amount))
    }

    fn total_return(&self) -> Metric {
        let m = self.metrics();
        figure("Total return", m.total_return.map(fine), format!("From {}, after costs.", self.money(m.initial_equity)))
    }

    fn final_equity(&self) -> Metric {
        figure("Final equity", Some(self.money(self.metrics().final_equity)), "Cash, and positions at their last price.")
    }

    fn cagr(&self) -> Metric {
        let a_year = made_yearly(&self.metrics().returns);
        figure(
            "Return a year",
            self.metrics().cagr.map(fine),
            format!("Compounded over years of 365.25 days. {a_year}").trim(),
        )
    }

    fn sharpe(&self) -> Metric {
        let returns = &self.metrics().returns;
        let error = returns.sharpe_standard_error.map(|e| format!(" Standard error {}.", number(e))).unwrap_or_default();
        let help = format!("Mean over deviation of daily returns.{error} {}", made_yearly(returns));
        figure("Sharpe ratio", returns.sharpe.map(number), help)
    }

    fn volatility(&self) -> Metric {
        let returns = &self.metrics().returns;
        let help = format!("Deviation of daily returns. {}", made_yearly(returns));
        figure("Volatility", returns.annualised_volatility.map(fine), help)
    }

    fn max_drawdown(&self) -> Metric {
        let deepest = self.metrics().max_drawdown.map(|fall| fine(fall.depth));
        figure("Largest drawdown", deepest, "Deepest fall from a high of equity.")
    }

    fn turnover(&self) -> Metric {
        figure("Turnover", self.metrics().turnover.map(number), "Value traded, both ways, over mean equity.")
    }

    fn exposure(&self) -> Metric {
        figure("Time invested", self.metrics().exposure.map(percent), "Part of all events at which something was held.")
    }

    fn round_trips(&self) -> Metric {
        let t = &self.metrics().trading;
        let closed = decimals(t.closed as f64, 0);
        let open = if t.open > 0 { format!(" {} more were under way at the end.", t.open) } else { String::new() };
        figure("Round trips won", t.hit_rate.map(percent), format!("Of {closed} from flat to flat, after fees.{open}"))
    }

    fn costs(&self) -> Metric {
        let help = "Of all fills against the prices at which they were decided, fees included.";
        figure("Costs", Some(self.money(self.metrics().costs.shortfall)), help)
    }

    fn costs_bps(&self) -> Metric {
        let bps = self.metrics().costs.shortfall_bps.map(|bps| format!("{} bps", significant(bps, 3)));
        figure("Costs of value traded", bps, "The same over the value traded at the prices of the decisions.")
    }

    fn fills(&self) -> Metric {
        let counts = &self.summary.counts;
        let rejected: usize = counts.rejected.values().sum();
        let count = |n: usize| decimals(n as f64, 0);
        let help = format!("Of {} orders sent; {} more were refused.", count(counts.orders), count(rejected));
        figure("Fills", Some(count(counts.fills)), help)
    }

    fn of_return(&self) -> Vec<Metric> {
        let returns = &self.metrics().returns;
        vec![
            self.total_return(),
            self.final_equity(),
            self.cagr(),
            self.sharpe(),
            figure(
                "Probabilistic Sharpe ratio",
                returns.probabilistic_sharpe.map(percent),
                "Probability that the true ratio is above 0, by number, skewness and kurtosis of the returns. For the best of \
                 several runs it says too much.",
            ),
            figure("Sortino ratio", returns.sortino.map(number), "Mean over downside deviation of daily returns, target 0."),
            figure("Calmar ratio", self.metrics().calmar.map(number), "Return a year over the largest drawdown."),
            figure("Best day", returns.best_day.map(fine), "Largest daily return."),
            figure("Worst day", returns.worst_day.map(fine), "Smallest daily return."),
        ]
    }

    fn of_risk(&self) -> Vec<Metric> {
        let (m, returns) = (self.metrics(), &self.metrics().returns);
        vec![
            self.volatility(),
            self.max_drawdown(),
            figure("Longest under water", m.longest_under_water.map(span), "From a high to its recovery, or to the end."),
            figure("Ulcer index", m.ulcer_index.map(fine), "Root mean square of the drawdowns at the ends of days."),
            figure("Value at risk", returns.value_at_risk_95.map(fine), "A day's loss that 95 % of days do not exceed."),
            figure("Expected shortfall", returns.expected_shortfall_95.map(fine), "Mean loss of the worst 5 % of days."),
            figure("Skewness", returns.skewness.map(number), "Of daily returns; below 0 where losses are the larger ones."),
            figure("Kurtosis", returns.kurtosis.map(number), "Of daily returns; 3 for a normal distribution."),
        ]
    }

    fn of_trading(&self) -> Vec<Metric> {
        let (m, t) = (self.metrics(), &self.metrics().trading);
        let sides = format!("{} long, {} short.", decimals(t.long as f64, 0), decimals(t.short as f64, 0));
        vec![
            figure("Round trips", Some(decimals(t.closed as f64, 0)), format!("From flat to flat: {sides}")),
            self.round_trips(),
            figure("Profit factor", t.profit_factor.map(number), "What trips won over what trips lost."),
            figure("Expectancy", self.maybe_money(t.expectancy), "Mean gain of a trip, after fees."),
            figure("Mean return of a trip", t.mean_return.map(fine), "Gain over what was entered."),
            figure("Average win", self.maybe_money(t.average_win), largest(self.maybe_money(t.largest_win))),
            figure("Average loss", self.maybe_money(t.average_loss), largest(self.maybe_money(t.largest_loss))),
            figure("Mean time held", t.mean_seconds.map(span), "From the first fill of a trip to its last."),
            figure(
                "Closing fills that gained",
                m.hit_rate.map(percent),
                "Part of the fills that closed something which gained after their own fee.",
            ),
            self.turnover(),
            figure("Turnover a year", m.turnover_per_year.map(number), made_yearly(&m.returns)),
            self.exposure(),
            figure("Mean leverage", m.mean_leverage.map(number), "Mean of what was held, either way, over equity."),
        ]
    }

    fn of_costs(&self) -> Vec<Metric> {
        let (m, costs) = (self.metrics(), &self.metrics().costs);
        let money = |amount: f64| Some(self.money(amount));
        vec![
            self.costs(),
            self.costs_bps(),
            figure("Timing", money(costs.timing), "The market moved between decision and arrival."),
            figure("Spread and impact", money(costs.spread_and_impact), "Added to the price that was met."),
            figure("Rounding to a tick", money(costs.rounding), "Against the order."),
            figure("Fees", money(costs.fees), "Commissions and other charges of fills."),
            figure("Value decided on", money(costs.decided_value), "What was filled, at the prices of the decisions."),
            figure("Gain before fees", money(m.realised + m.unrealised), "Realised and still held, at average cost."),
            self.fills(),
        ]
    }
}

/// What the largest of a kind was.
fn largest(amount: Option<String>) -> String {
    amount.map_or_else(|| "There was none.".to_owned(), |amount| format!("The largest was {amount}."))
}

/// What figures of a year rest on, or why there are none.
fn made_yearly(returns: &Returns) -> String {
    let Returns { daily_returns: count, gaps, .. } = *returns;
    if count < Returns::FEWEST {
        return format!("Not given for {count} daily returns: it takes {}.", Returns::FEWEST);
    }
    let left_out = match gaps {
        0 => String::new(),
        1 => " One gap of more than a week is left out.".to_owned(),
        many => format!(" {many} gaps of more than a week are left out."),
    };
    let a_year = returns.returns_per_year.map(number).unwrap_or_default();
    format!("From {} daily returns, {a_year} of them a year.{left_out}", decimals(count as f64, 0))
}

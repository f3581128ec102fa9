//! Makes orders of real tapes, diagnoses what their executions cost beyond the touch, measures what the market does after them, and
//! prints `reports/tape.md`: `cargo run --release --example tape_executions -- FOLDER`, where FOLDER holds `bitstamp_l3_2015/` and
//! `binance_20240808/`. `./x tape` does so.
#![allow(clippy::print_stdout, reason = "what it prints is what it is for")]

use std::error::Error;
use std::fmt::{Display, Write as _};
use std::path::{Path, PathBuf};

use trueup::io::{InputError, OutputFolder, Overwrite, TwinFile};
use trueup::market::response::{Estimated, Felt, MidTrack, hill, mean_moves, propagator, runs, sign_memory, size_response};
use trueup::market::tape_orders::{
    Selection, TapeFolder, TapeOrder, TapeReading, TapeSettings, TapeSink, TapeSources, Thinning,
};
use trueup::market::{Level, Print, execution_twin};
use trueup::sim2real::diagnose::{Diagnosis, diagnose};
use trueup::sim2real::{Seed, Timestamp};

/// A tape.
struct Set {
    folder: &'static str,
    symbol: &'static str,
    what: &'static str,
    /// How long after the last execution all of it is told [s].
    told_within: f64,
    /// How long after a trade orders must come to be diagnosed [ms]; each is a row.
    apart: &'static [i64],
}

const SETS: [Set; 2] = [
    Set {
        folder: "bitstamp_l3_2015",
        symbol: "BTCUSD",
        what: "order by order, 5 h of 1 May 2015",
        told_within: 0.1,
        apart: &[0],
    },
    Set {
        folder: "binance_20240808",
        symbol: "BTCUSDT",
        what: "perpetual; trades, changes of the book every 50 ms and its best at once, 5.7 min of 8 August 2024",
        told_within: 0.1,
        apart: &[50, 5, 0],
    },
];

/// Where the mid is read after an order [s].
const DELAYS: [f64; 9] = [0.0, 0.1, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 300.0];

/// Orders of one sign that come later than this after the one before begin a run of their own [s].
const PAUSE: f64 = 10.0;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("give the folder of the tapes")?);
    let mut found = Vec::new();
    for set in &SETS {
        found.push(measured(set, &folder.join(set.folder))?);
        eprintln!("{}", set.folder);
    }
    let mut text = String::from(HEAD);
    text += &orders_table(&found)?;
    text += &costs_table(&found, &folder)?;
    text += &moves_table(&found)?;
    text += &exponents_table(&found)?;
    text += &sizes_table(&found)?;
    print!("{text}{FOOT}");
    Ok(())
}

/// All that a tape tells.
struct Measured<'a> {
    set: &'a Set,
    reading: TapeReading,
    orders: Vec<TapeOrder>,
    felt: Vec<Felt>,
    mids: MidTrack,
}

/// Keeps orders and mids in memory.
#[derive(Default)]
struct Collected {
    orders: Vec<TapeOrder>,
    mids: MidTrack,
}

impl TapeSink for Collected {
    type Error = InputError;

    fn quote(&mut self, time: Timestamp, bids: &[Level], asks: &[Level]) -> Result<(), InputError> {
        if let Some((bid, ask)) = bids.first().zip(asks.first()) {
            self.mids.push(time, 0.5 * (bid.price + ask.price));
        }
        Ok(())
    }

    fn print(&mut self, _print: Print) -> Result<(), InputError> {
        Ok(())
    }

    fn order(&mut self, order: TapeOrder) -> Result<(), InputError> {
        self.orders.push(order);
        Ok(())
    }
}

fn measured<'a>(set: &'a Set, folder: &Path) -> Result<Measured<'a>, InputError> {
    let mut collected = Collected::default();
    // All orders whose book is known, however near to one another: each of them is one of the signs.
    let settings = TapeSettings { levels: 1, apart: 0 };
    let reading = TapeSources::find(&[folder.to_path_buf()])?.read(settings, &mut collected)?;
    let Collected { mut orders, mids } = collected;
    orders.sort_by_key(|order| order.decided_at);
    let felt = orders
        .iter()
        .map(|order| Felt {
            came_at: order.decided_at,
            done_at: order.done_at(),
            side: order.side,
            volume: order.filled().to_f64(),
        })
        .collect();
    Ok(Measured { set, reading, orders, felt, mids })
}

const HEAD: &str = "# Real orders, out of tapes\n\n\
Made by `./x tape`. Whoever took from a book sent a real order, and the tape shows each of its executions. `trueup data import \
--tape` makes a log of them ([docs/tape.md](../docs/tape.md)); here they are diagnosed against a twin that fills at the touch, and the \
market is watched after them. Sources of the tapes: P. Stubbings' package ob-analytics (Bitstamp), the examples of hftbacktest \
(Binance's futures). Intervals are of 95 %, by resampling blocks of time or of orders; *not to be had* where the tape has not eight \
blocks twice as long as what is asked for, or the data speak for no power law.\n\n";

const FOOT: &str = "\n## What this says, and what it cannot\n\n\
- **The touch leaves out the walk through the book.** Level by level, as displayed strictly before the order, is what orders pay: \
to the last digit on Bitstamp, where the file tells every order and the first execution is never off the touch: no hidden \
orders, no queues that anybody jumps. On Binance it is so for orders that come 50 ms or more after a trade, when the levels behind the \
touch have been told of. Nearer to one another they meet a book that nobody was shown: what the walk does not explain comes within some \
milliseconds of a sweep, and nothing in the files tells hidden orders from that. Taken as they come, they leave a diagnosis \
`unexplained`, as it should be.\n\
- **The sample of costs is of orders that were executed whole.** Limits of the others bound them; their logs are written as \
`limit`, and a diagnosis leaves them out. On Binance what somebody asked for and did not get is not on the tape at all.\n\
- **The square root is a law of metaorders** (exponent .489 ± .0015, Sato & Kanazawa, arXiv 2411.13965): of parent orders that \
are worked over hours, whose owners must be known. Neither tape has traders' ids. What single orders do at once is another \
quantity, flatter in size because nobody sends more than the book holds (Lillo, Farmer & Mantegna 2003). Runs of one sign are a \
stand-in: several owners may be in one run, and one owner in many. That their exponent is near a half, or is not, neither \
confirms nor contradicts the law.\n\
- **R(tau) is what follows an order, not what it does**: the orders that go on in its direction are in it. The propagator takes \
them out, as far as the future depends on the past signs alone and linearly; sizes are left out of it.\n\
- **The propagator of Binance rises over the first ten orders**, which is half a second, and fades after that: best prices are \
told later than the next order comes, and others answer. From the first order on it is no power law, and the exponent below 0 says so.\n\
- **Five hours and six minutes of one instrument each, on days of their own.** Intervals hold what varies within them, not \
between days.\n";

fn orders_table(found: &[Measured<'_>]) -> Result<String, std::fmt::Error> {
    let mut text = String::from(
        "## Orders\n\n| tape | orders | executed whole | executions an order: mean / 99 % / most | size: 10 / 50 / 90 / 99 % | tail of sizes (largest 10 %) | first execution: at the touch / better / worse |\n|---|---|---|---|---|---|---|\n",
    );
    let mut left = String::new();
    for of in found {
        let counts = &of.reading.counts;
        let fills: Vec<f64> = of.orders.iter().map(|order| order.fills.len() as f64).collect();
        let sizes: Vec<f64> = of.felt.iter().map(|felt| felt.volume).collect();
        let tail = hill(&sizes, 0.1).map_or_else(
            || NOT_TO_BE_HAD.to_owned(),
            |tail| format!("{:.2} ± {:.2} ({} orders)", tail.exponent, tail.std_error, tail.count),
        );
        writeln!(
            text,
            "| {}: {} | {} | {} | {:.2} / {:.0} / {:.0} | {} | {tail} | {} / {} / {} |",
            of.set.folder,
            of.set.what,
            counts.orders,
            counts.market,
            counts.fills as f64 / counts.orders.max(1) as f64,
            quantile(&fills, 0.99),
            quantile(&fills, 1.0),
            [0.1, 0.5, 0.9, 0.99].map(|part| short(quantile(&sizes, part)).to_string()).join(" / "),
            counts.at_touch,
            counts.better_than_touch,
            counts.worse_than_touch,
        )?;
        for line in counts.lines() {
            writeln!(left, "- {}: {line}", of.set.folder)?;
        }
    }
    Ok(format!("{text}\nLeft out:\n\n{left}\n"))
}

fn costs_table(found: &[Measured<'_>], folder: &Path) -> Result<String, Box<dyn Error>> {
    let mut text = String::from(
        "## Cost beyond the touch\n\nErrors are those of the cost of orders that no fit has seen (the last 30 % in time) [bps]: root of the mean square, and mean absolute.\n\n| tape | orders written | verdict and names | rms: as given / recalibrated / trued | mean: as given / trued | improvement |\n|---|---|---|---|---|---|\n",
    );
    for of in found {
        for apart in of.set.apart {
            let (orders, diagnosis) = diagnosed(of.set, &folder.join(of.set.folder), *apart)?;
            let Some(fit) = diagnosis.fit.iter().find(|fit| fit.channel == "cost") else { continue };
            let far = if of.set.apart.len() > 1 { format!(", {apart} ms or more after a trade") } else { String::new() };
            writeln!(
                text,
                "| {}{far} | {orders} | `{}`: {} | {} / {} / **{}** | {} / **{}** | {:.0} to {:.0} % |",
                of.set.folder,
                diagnosis.verdict,
                names(&diagnosis),
                short(fit.nominal_rmse),
                short(fit.recalibrated_rmse),
                short(fit.trued_rmse),
                short(fit.nominal_mae),
                short(fit.trued_mae),
                100.0 * fit.improvement_ci95[0],
                100.0 * fit.improvement_ci95[1],
            )?;
            eprintln!("{}: {}", of.set.folder, diagnosis.summary);
        }
    }
    Ok(text + "\n")
}

/// The diagnosis of at most 2000 orders of a tape, and how many there were.
fn diagnosed(set: &Set, folder: &Path, apart: i64) -> Result<(u64, Diagnosis), InputError> {
    let scratch = tempfile::tempdir().map_err(|error| InputError::new("a scratch folder", error.to_string()))?;
    let out = scratch.path().join(set.symbol);
    let settings = TapeSettings { apart: apart * 1_000_000, ..TapeSettings::default() };
    let selection = Selection { thinning: Thinning::AtMost(Selection::AT_MOST), ..Selection::default() };
    let sources = TapeSources::find(&[folder.to_path_buf()])?;
    let output = OutputFolder::create(&out, Overwrite::Refuse)?;
    let mut writing = TapeFolder::create(output, set.symbol, settings.levels, selection)?;
    let reading = sources.read(settings, &mut writing)?;
    let written = writing.finish(&sources, &reading)?;
    let twin = TwinFile::read(out.join("assumed.toml"))?;
    let (assembly, recordings) = execution_twin(&twin, &[out])?;
    Ok((written.orders, diagnose(&assembly, &recordings, &[], Seed(0), &|_, _, _| {}).diagnosis))
}

fn names(diagnosis: &Diagnosis) -> String {
    let one = |effect: &trueup::sim2real::diagnose::Effect| {
        let values: Vec<String> = effect
            .parameters
            .iter()
            .map(|(name, parameter)| format!("{name} {} ± {}", short(parameter.value), short(parameter.std)))
            .collect();
        format!("{} ({})", effect.mechanism, values.join(", "))
    };
    let all: Vec<String> = diagnosis.effects.iter().map(one).collect();
    if all.is_empty() { "nothing".to_owned() } else { all.join(", ") }
}

fn moves_table(found: &[Measured<'_>]) -> Result<String, std::fmt::Error> {
    let mut text = String::from(
        "## What follows an order: R(tau)\n\nMean move of the mid with the order [bps], from strictly before it to tau after its last execution. Bitstamp tells of the resting half of an execution up to 35 ms after the other, so that some of what an order does at once is in 0.1 s and not in 0.\n\n| tau [s] |",
    );
    for of in found {
        write!(text, " {} | orders |", of.set.folder)?;
    }
    text += "\n|---|";
    found.iter().for_each(|_| text += "---|---|");
    text.push('\n');
    let moves: Vec<_> = found.iter().map(|of| mean_moves(&of.felt, &of.mids, &DELAYS, Seed(1))).collect();
    for (row, delay) in DELAYS.iter().enumerate() {
        write!(text, "| {delay} |")?;
        for of in &moves {
            let own = &of[row];
            let cell = match (own.mean, own.ci95) {
                (Some(mean), Some([low, high])) => format!("{mean:.3} ({low:.3} to {high:.3})"),
                _ => NOT_TO_BE_HAD.to_owned(),
            };
            write!(text, " {cell} | {} |", own.orders)?;
        }
        text.push('\n');
    }
    Ok(text + "\n")
}

fn exponents_table(found: &[Measured<'_>]) -> Result<String, std::fmt::Error> {
    let mut rows: [(&str, Vec<String>, &str); 5] = [
        (
            "immediate response to size, psi of `R ~ v^psi`",
            Vec::new(),
            ".1 to .5, flatter for the largest (Lillo, Farmer & Mantegna 2003)",
        ),
        (
            "runs of one sign, `move ~ Q^delta`",
            Vec::new(),
            ".489 ± .0015 of metaorders (Sato & Kanazawa, arXiv 2411.13965); runs are none",
        ),
        ("memory of signs, gamma of `C ~ lag^-gamma`", Vec::new(), ".4 to .7 (Lillo & Farmer 2004; Bouchaud et al. 2004)"),
        (
            "decay of the propagator, beta of `G ~ l^-beta`",
            Vec::new(),
            ".2 to .4, near (1 - gamma) / 2 (Bouchaud et al. 2004)",
        ),
        ("the same from the tenth order on", Vec::new(), "the same"),
    ];
    let mut kernels = String::new();
    for of in found {
        let signs: Vec<f64> = of.felt.iter().map(|felt| felt.side.sign()).collect();
        let first = of.felt.iter().find_map(|felt| of.mids.at(felt.came_at)).unwrap_or(1.0);
        let mids: Vec<Option<f64>> =
            of.felt.iter().map(|felt| of.mids.at(felt.came_at).map(|mid| (mid / first).ln() * 1e4)).collect();
        let sizes = size_response(&of.felt, &of.mids, of.set.told_within, 10, Seed(1));
        let all_runs: Vec<Felt> = runs(&of.felt, PAUSE).iter().filter(|run| run.orders > 1).map(|run| run.felt).collect();
        let run_sizes = size_response(&all_runs, &of.mids, of.set.told_within, 10, Seed(2));
        let memory = sign_memory(&signs, 200, Seed(3));
        let lags = (signs.len() / 20).min(100);
        let propagated = propagator(&signs, &mids, lags, Seed(4));
        rows[0].1.push(estimated(sizes.and_then(|sizes| sizes.exponent)));
        rows[1].1.push(format!("{} ({} runs)", estimated(run_sizes.and_then(|sizes| sizes.exponent)), all_runs.len()));
        rows[2].1.push(estimated(memory.as_ref().and_then(|memory| memory.gamma)));
        rows[3].1.push(estimated(propagated.as_ref().and_then(|own| own.beta)));
        rows[4].1.push(estimated(propagated.as_ref().and_then(|own| own.later_beta)));
        if let Some(own) = propagated {
            let at =
                [1, 2, 5, 10, 20, 50, 100].into_iter().filter_map(|l| Some(format!("{l}: {:.3}", own.kernel.get(l - 1)?)));
            writeln!(
                kernels,
                "- {}: G(l) [bps] after l orders, of {} returns and {lags} lags: {}",
                of.set.folder,
                own.returns,
                at.collect::<Vec<_>>().join(", ")
            )?;
        }
        if let Some(memory) = memory {
            let at = memory.autocorrelation.iter().step_by(2).map(|(lag, c)| format!("{lag:.0}: {c:.3}"));
            writeln!(kernels, "- {}: C(lag) of signs: {}", of.set.folder, at.collect::<Vec<_>>().join(", "))?;
        }
    }
    let heads: Vec<&str> = found.iter().map(|of| of.set.folder).collect();
    let mut text = format!(
        "## Exponents\n\n| exponent | {} | published |\n|---|{}---|\n",
        heads.join(" | "),
        "---|".repeat(found.len())
    );
    for (what, values, published) in rows {
        writeln!(text, "| {what} | {} | {published} |", values.join(" | "))?;
    }
    Ok(format!("{text}\n{kernels}\n"))
}

fn sizes_table(found: &[Measured<'_>]) -> Result<String, std::fmt::Error> {
    let mut text = String::from(
        "## The immediate response by size\n\nMean move of the mid 0.1 s after the last execution, with its standard error [bps].\n",
    );
    for of in found {
        let Some(sizes) = size_response(&of.felt, &of.mids, of.set.told_within, 10, Seed(1)) else { continue };
        writeln!(text, "\n| {}: size | move | orders |\n|---|---|---|", of.set.folder)?;
        for bin in sizes.bins {
            writeln!(text, "| {} | {:.3} ± {:.3} | {} |", short(bin.volume), bin.mean, bin.std_error, bin.orders)?;
        }
    }
    Ok(text)
}

const NOT_TO_BE_HAD: &str = "not to be had";

fn estimated(value: Option<Estimated>) -> String {
    value.map_or_else(
        || NOT_TO_BE_HAD.to_owned(),
        |own| format!("{:.2} ({:.2} to {:.2})", own.value, own.ci95[0], own.ci95[1]),
    )
}

fn quantile(values: &[f64], part: f64) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values.get(((values.len().max(1) - 1) as f64 * part).round() as usize).copied().unwrap_or_default()
}

/// Three digits.
fn short(value: f64) -> impl Display {
    match value.abs() {
        size if size > 0.0 && size < 1e-3 => format!("{value:.1e}"),
        size if size < 1.0 => format!("{value:.4}"),
        _ => format!("{value:.2}"),
    }
}

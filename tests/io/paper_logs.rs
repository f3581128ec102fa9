//! Logs of paper and live orders as brokers and bots write them: what is read of each, against figures counted otherwise.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use crate::paper_scene::{Written, counts, new_york, read, recorded, sample};
use trueup::market::paper::import::{ImportSettings, SymbolMap, import};
use trueup::market::paper::{
    FillOrigin, FindingKind, Liquidity, OrderWords, PaperFill, PaperLog, PaperOrder, PaperStatus, TimeColumn, TimeMeaning,
};
use trueup::market::{Cash, Price, Quantity, Side};

fn price(text: &str) -> Price {
    text.parse().unwrap()
}

fn quantity(text: &str) -> Quantity {
    text.parse().unwrap()
}

fn cash(text: &str) -> Cash {
    text.parse().unwrap()
}

fn order<'a>(log: &'a PaperLog, id: &str) -> &'a PaperOrder {
    log.orders.iter().find(|order| order.id == id).unwrap()
}

fn fills_of<'a>(log: &'a PaperLog, id: &str) -> Vec<&'a PaperFill> {
    log.fills.iter().filter(|fill| fill.order_id.as_deref() == Some(id)).collect()
}

/// What all fills came to, and what was paid for them.
fn sums(log: &PaperLog) -> (Cash, Cash) {
    log.fills.iter().fold((Cash::ZERO, Cash::ZERO), |(value, fees), fill| {
        let fee = fill.fee.unwrap_or(Cash::ZERO);
        (value.plus(fill.price * fill.quantity).unwrap(), fees.plus(fee).unwrap())
    })
}

fn meaning(log: &PaperLog, column: TimeColumn) -> Option<TimeMeaning> {
    log.clocks.iter().find(|clock| clock.column == column).map(|clock| clock.meaning)
}

#[test]
fn alpaca_is_read_with_legs_replacements_and_the_earlier_stamp() {
    let log = read(&[sample("alpaca_orders.json"), sample("alpaca_activities.json")]);
    assert_eq!((log.format.as_str(), log.orders.len(), log.fills.len()), ("alpaca", 6, 5));
    let bracket = order(&log, "61e69015-8549-4bfd-b9c3-01e75843f47d");
    assert_eq!(bracket.decided_at.unwrap().to_string(), "2024-03-08T14:31:02.121856Z");
    assert_eq!((bracket.limit_price, bracket.quantity), (Some(price("170.15")), Some(quantity("15"))));
    // Its two executions count and not the total; the second is there twice.
    let fills = fills_of(&log, &bracket.id);
    assert_eq!(fills.iter().map(|fill| fill.price).collect::<Vec<_>>(), [price("170.1"), price("170.12")]);
    assert!(fills.iter().all(|fill| fill.origin == FillOrigin::Execution && fill.currency.as_deref() == Some("USD")));
    let leg = order(&log, "leg-stop");
    assert_eq!((leg.parent.as_deref(), leg.stop_price), (Some(bracket.id.as_str()), Some(price("165"))));
    assert_eq!(leg.status, Some(PaperStatus::Cancelled));
    assert_eq!(order(&log, "old").replaced_by.as_deref(), Some("new"));
    assert_eq!(order(&log, "close").kind, Some(OrderWords::MarketOnClose));
    assert_eq!(order(&log, "notional").quantity, None);
    assert_eq!(fills_of(&log, "notional")[0].origin, FillOrigin::OrderTotal);
    assert_eq!((fills_of(&log, "new")[0].quantity, order(&log, "new").filled), (quantity("4"), Some(quantity("4"))));
    assert_eq!(fills_of(&log, "another-day")[0].side, Some(Side::Sell));
    use FindingKind as F;
    let expected = [
        (F::PassedOver, 1),
        (F::TimesOutOfOrder, 1),
        (F::Duplicate, 1),
        (F::FillWithoutOrder, 1),
        (F::Replaced, 1),
        (F::BrokenChain, 1),
        (F::TotalsOnly, 2),
        (F::Notional, 1),
    ];
    assert_eq!(counts(&log), expected);
}

#[test]
fn flex_is_read_in_its_zone_without_what_was_taken_back() {
    let log = import(&[sample("flex.xml")], &new_york()).unwrap();
    assert_eq!((log.format.as_str(), log.orders.len(), log.fills.len()), ("ibkr_flex", 2, 3));
    // A time with a zone of its own is in that, the others in the one given; both are the same here.
    let bought = fills_of(&log, "900");
    let times: Vec<String> = bought.iter().map(|fill| fill.filled_at.to_string()).collect();
    assert_eq!(times, ["2024-03-08T14:31:05Z", "2024-03-08T14:31:06Z"]);
    assert_eq!(bought[0].fee, Some(cash("0.36")));
    assert_eq!(order(&log, "900").client_id.as_deref(), Some("sma"));
    // The execution at 515.5 was taken back, the one that corrects it counts.
    let sold = fills_of(&log, "901");
    assert_eq!((sold.len(), sold[0].price, sold[0].quantity), (1, price("515.4"), quantity("25")));
    assert_eq!((sold[0].side, order(&log, "901").kind.clone()), (Some(Side::Sell), Some(OrderWords::Market)));
    use FindingKind as F;
    let found = |kind| log.findings.count(kind);
    assert_eq!((found(F::Bust), found(F::Correction), found(F::MixedZones), found(F::UnreadRow)), (1, 1, 1, 1));
    assert_eq!((order(&log, "901").filled, found(F::FilledOtherwise)), (Some(quantity("25")), 0));
    let unread = log.findings.of(F::UnreadRow)[0].to_string();
    assert!(unread.ends_with("Trade: row 6, column `tradePrice`: expected a decimal number, found \"94,5\""), "{unread}");
}

#[test]
fn a_time_without_a_zone_is_never_guessed() {
    let error = import(&[sample("flex.xml")], &ImportSettings::default()).unwrap_err().to_string();
    assert!(error.contains("row 1, column `orderTime`: the time has no zone, and none is given"), "{error}");
    assert!(error.contains("hint: say the zone"), "{error}");
}

const FREQTRADE: &str = "\
CREATE TABLE trades (id INTEGER, pair TEXT, is_open BOOLEAN, fee_open FLOAT, fee_open_cost FLOAT, fee_open_currency TEXT,
  fee_close FLOAT, fee_close_cost FLOAT, fee_close_currency TEXT, open_rate FLOAT, stake_amount FLOAT, strategy TEXT,
  enter_tag TEXT, exit_reason TEXT, is_short BOOLEAN);
CREATE TABLE orders (id INTEGER, ft_trade_id INTEGER, ft_order_side TEXT, ft_pair TEXT, order_id TEXT, status TEXT,
  order_type TEXT, side TEXT, price FLOAT, average FLOAT, amount FLOAT, filled FLOAT, stop_price FLOAT, order_date DATETIME,
  order_filled_date DATETIME, order_update_date DATETIME);
INSERT INTO trades VALUES (1, 'ETH/USDT', 0, 0.001, 0.39, 'USDT', 0.001, NULL, NULL, 3900.0, 390.0, 'Sample', 'dip', 'roi', 0),
  (2, 'SOL/USDT:USDT', 1, 0.0005, 0.00002, 'BNB', 0.0005, NULL, NULL, 150.0, 150.0, 'Sample', NULL, NULL, 1);
INSERT INTO orders VALUES
  (1, 1, 'buy', 'ETH/USDT', 'o1', 'closed', 'limit', 'buy', 3900.0, 3899.5, 0.1, 0.1, NULL, '2024-03-08 15:00:00.100000',
   '2024-03-08 15:00:05.200000', '2024-03-08 15:00:05.300000'),
  (3, 1, 'sell', 'ETH/USDT', 'o3', 'closed', 'market', 'sell', 3950.0, 3949.0, 0.06, 0.06, NULL, '2024-03-08 16:00:00.100000',
   '2024-03-08 16:00:05.200000', '2024-03-08 16:00:05.300000'),
  (4, 1, 'sell', 'ETH/USDT', 'o4', 'canceled', 'limit', 'sell', 4000.0, 4000.0, 0.04, 0.01, NULL, '2024-03-08 16:01:00.100000',
   NULL, '2024-03-08 17:00:05.300000'),
  (5, 2, 'sell', 'SOL/USDT:USDT', 'o5', 'closed', 'limit', 'sell', 150.0, 150.0, 1.0, 1.0, NULL, '2024-03-08 18:00:00.100000',
   '2024-03-08 18:00:09.000000', '2024-03-08 18:00:09.100000');
";

#[test]
fn freqtrade_fees_are_those_of_the_trade_or_by_its_rate() {
    let written = Written::database("tradesv3.sqlite", FREQTRADE);
    let log = written.import(&ImportSettings::default()).unwrap();
    assert_eq!((log.orders.len(), log.fills.len()), (4, 4));
    let fee = |id: &str| fills_of(&log, id)[0].fee;
    assert_eq!(fee("o1"), Some(cash("0.39")));
    // Two exits share a fee that is not stated: 0.1 % of 0.06 at 3949 and of 0.01 at 4000.
    assert_eq!((fee("o3"), fee("o4")), (Some(cash("0.23694")), Some(cash("0.04"))));
    assert_eq!((fee("o5"), fills_of(&log, "o5")[0].charged.clone().unwrap().amount), (None, cash("0.00002")));
    let tags: Vec<Option<&str>> = log.orders.iter().map(|order| order.tag.as_deref()).collect();
    assert_eq!(tags, [Some("dip"), Some("roi"), Some("roi"), None]);
    assert_eq!(order(&log, "o4").status, Some(PaperStatus::Cancelled));
    let gaps = log.findings.of(FindingKind::Survivorship)[0].to_string();
    assert!(gaps.ends_with("of 5 orders 1 are not there"), "{gaps}");
    assert_eq!(meaning(&log, TimeColumn::FilledAt), Some(TimeMeaning::Polled));
    let mut settings = ImportSettings { symbols: SymbolMap::of([("ETH/USDT".into(), "ETH".into())]), ..Default::default() };
    settings.rates.add("BNB/USDT=600").unwrap();
    let log = written.import(&settings).unwrap();
    assert_eq!(log.symbols(), ["ETH", "SOL/USDT:USDT"]);
    assert_eq!(fills_of(&log, "o5")[0].fee, Some(cash("0.012")));
    assert_eq!((log.findings.count(FindingKind::Unmapped), log.findings.count(FindingKind::FeeConverted)), (1, 1));
}

const HUMMINGBOT: &str = "\
CREATE TABLE \"Order\" (id TEXT, config_file_path TEXT, strategy TEXT, market TEXT, symbol TEXT, base_asset TEXT,
  quote_asset TEXT, creation_timestamp BIGINT, order_type TEXT, amount BIGINT, leverage INTEGER, price BIGINT,
  last_status TEXT, last_update_timestamp BIGINT, exchange_order_id TEXT, position TEXT);
CREATE TABLE OrderStatus (id INTEGER, order_id TEXT, timestamp BIGINT, status TEXT);
CREATE TABLE TradeFill (config_file_path TEXT, strategy TEXT, market TEXT, symbol TEXT, base_asset TEXT, quote_asset TEXT,
  timestamp BIGINT, order_id TEXT, trade_type TEXT, order_type TEXT, price BIGINT, amount BIGINT, leverage INTEGER,
  trade_fee JSON, trade_fee_in_quote BIGINT, exchange_trade_id TEXT, position TEXT);
CREATE TABLE MarketState (saved_state JSON);
INSERT INTO \"Order\" VALUES
  ('HBOT1', 'c.yml', 'pmm', 'kucoin', 'ETH-USDT', 'ETH', 'USDT', 1709910000123, 'LIMIT', 500000, 1, 3900510000,
   'SellOrderCompleted', 1709910009000, 'x1', 'NIL'),
  ('HBOT2', 'c.yml', 'pmm', 'kucoin', 'ETH-USDT', 'ETH', 'USDT', 1709910010123, 'LIMIT_MAKER', 1000000, 1, 3899000000,
   'OrderCancelled', 1709910019000, 'x2', 'NIL'),
  ('HBOT3', 'c.yml', 'pmm', 'kucoin', 'ETH-USDT', 'ETH', 'USDT', 1709910020123, 'LIMIT', 1000000, 1, 3898000000,
   'OrderCancelled', 1709910029000, 'x3', 'NIL');
INSERT INTO OrderStatus VALUES (1, 'HBOT2', 1709910010123, 'BuyOrderCreated'), (2, 'HBOT2', 1709910019000, 'OrderCancelled');
INSERT INTO TradeFill VALUES ('c.yml', 'pmm', 'kucoin', 'ETH-USDT', 'ETH', 'USDT', 1709910009000, 'HBOT1', 'SELL', 'LIMIT',
  3900510000, 500000, 1, '{\"fee_type\": \"DeductedFromReturns\", \"percent\": \"0.001\", \"percent_token\": null, \"flat_fees\": []}',
  1950255, 't1', 'NIL');
";

#[test]
fn hummingbots_millionths_and_sides_are_read() {
    let written = Written::database("strategy.sqlite", HUMMINGBOT);
    let log = written.import(&ImportSettings::default()).unwrap();
    assert_eq!((log.orders.len(), log.fills.len()), (2, 1));
    let (first, second) = (order(&log, "HBOT1"), order(&log, "HBOT2"));
    assert_eq!((first.side, first.quantity, first.limit_price), (Side::Sell, Some(quantity("0.5")), Some(price("3900.51"))));
    assert_eq!(first.decided_at.unwrap().to_string(), "2024-03-08T15:00:00.123Z");
    assert_eq!((second.side, second.kind.clone()), (Side::Buy, Some(OrderWords::PostOnly)));
    assert_eq!(log.fills[0].fee, Some(cash("1.950255")));
    // Nothing says which way the third order went.
    assert_eq!(log.findings.count(FindingKind::UnreadRow), 1);
    assert!(log.findings.of(FindingKind::PassedOver)[0].to_string().contains("MarketState"));
}

#[test]
fn hummingbots_older_databases_hold_numbers_with_a_point() {
    let older = HUMMINGBOT.replace("amount BIGINT", "amount FLOAT").replace("price BIGINT", "price FLOAT");
    let older =
        older.replace("500000, 1, 3900510000", "0.5, 1, 3900.51").replace("3900510000, 500000, 1", "3900.51, 0.5, 1");
    let older =
        older.replace("1000000, 1, 3899000000", "1.0, 1, 3899.0").replace("1000000, 1, 3898000000", "1.0, 1, 3898.0");
    let [older, newer] = [&older, HUMMINGBOT].map(|script| {
        let log = Written::database("strategy.sqlite", script).import(&ImportSettings::default()).unwrap();
        let orders = log.orders.iter().map(|order| (order.quantity, order.limit_price)).collect::<Vec<_>>();
        (orders, log.fills.iter().map(|fill| (fill.quantity, fill.price, fill.fee)).collect::<Vec<_>>())
    });
    assert_eq!(older, newer);
}

#[test]
fn hummingbots_table_of_trades_dates_orders_by_their_age() {
    let log = read(&[sample("trades_pure_mm.csv")]);
    assert_eq!((log.format.as_str(), log.orders.len(), log.fills.len()), ("hummingbot", 2, 3));
    let bought = order(&log, "buy-ETH-USDT-1");
    assert_eq!(bought.decided_at.unwrap().to_string(), "2024-03-08T14:59:18.123Z");
    assert_eq!((bought.filled, bought.quantity), (Some(quantity("0.5")), None));
    assert_eq!(order(&log, "sell-ETH-USDT-2").decided_at, None);
    let fees: Vec<Option<Cash>> = log.fills.iter().map(|fill| fill.fee).collect();
    // 0.1 % of 0.25 at 3900.51; 0.00025 ETH at that price; a token nobody gave a rate for.
    assert_eq!(fees, [Some(cash("0.9751275")), Some(cash("0.9751275")), None]);
    assert_eq!(log.findings.count(FindingKind::FeeInOtherCurrency), 1);
}

#[test]
fn the_events_of_a_stream_become_one_order() {
    let log = read(&[sample("binance_stream.jsonl")]);
    assert_eq!((log.format.as_str(), log.orders.len(), log.fills.len()), ("binance", 1, 1));
    let order = order(&log, "71");
    assert_eq!((order.status.clone(), order.filled), (Some(PaperStatus::Cancelled), Some(quantity("0.2"))));
    assert_eq!(order.decided_at.unwrap().to_string(), "2024-03-08T15:00:00.099Z");
    assert_eq!(order.ended_at.unwrap().to_string(), "2024-03-08T15:00:09.099Z");
    assert_eq!(order.average_price, Some(price("3900.1")));
    let fill = &log.fills[0];
    assert_eq!((fill.liquidity, fill.fee, fill.id.as_deref()), (Some(Liquidity::Maker), None, Some("901")));
    assert_eq!(log.findings.count(FindingKind::FeeInOtherCurrency), 1);
    assert_eq!(log.findings.count(FindingKind::PassedOver), 1);
}

#[test]
fn ccxt_orders_carry_their_trades_with_them() {
    let log = read(&[sample("ccxt_orders.json")]);
    assert_eq!((log.format.as_str(), log.orders.len(), log.fills.len()), ("ccxt", 3, 3));
    assert_eq!(order(&log, "1001").kind, Some(OrderWords::PostOnly));
    let fees: Vec<Option<Cash>> = fills_of(&log, "1001").iter().map(|fill| fill.fee).collect();
    assert_eq!(fees, [Some(cash("0.136001")), Some(cash("-0.0272"))]);
    let total = fills_of(&log, "1002")[0];
    assert_eq!((total.origin, total.price), (FillOrigin::OrderTotal, price("3900.25")));
    use FindingKind as F;
    let found = |kind| log.findings.count(kind);
    assert_eq!((found(F::UnreadRow), found(F::PriceOfOrder), found(F::FeeInOtherCurrency)), (1, 1, 1));
}

/// Counted and added up with Python's `sqlite3` and `decimal`: orders, closed ones, what these came to, fees, symbols.
#[test]
fn real_databases_of_freqtrade_hold_what_sqlite_counts() {
    let cases = [
        ("gtudor33_dryrun_binanceus_2021-12", 115, 112, 110_878.699_990_807_69, 110.878_699_990_807_68, 27),
        ("roger_dryrun_kucoin_2026-04", 11, 11, 118.419_314_83, 0.203_158_488_83, 7),
        ("selskas_dryrun_2021-04", 153, 153, 1.529_113_132_318_162_7, 0.001_529_113_132_318_163_5, 10),
        ("th2002_dryrun_2024-07", 25, 6, 631_704_870.168_331_6, 631_704.870_168_331_5, 4),
    ];
    for (name, orders, fills, value, fees, symbols) in cases {
        let Some(path) = recorded(&format!("freqtrade/{name}/tradesv3.sqlite")) else { return };
        let log = read(&[path]);
        assert_eq!((log.orders.len(), log.fills.len(), log.symbols().len()), (orders, fills, symbols), "{name}");
        let (sum, paid) = sums(&log);
        // Quantities below 1e-9 are rounded off.
        assert!((sum.to_f64() - value).abs() < 1e-8 * value, "{name}: {sum}");
        assert!((paid.to_f64() - fees).abs() < 1e-9 * fees.max(1.0), "{name}: {paid}");
        assert_eq!(log.findings.count(FindingKind::UnreadRow), 0, "{name}");
        assert_eq!(log.findings.count(FindingKind::TotalsOnly), fills, "{name}");
    }
}

/// Counted and added up with Python's `csv` and `decimal`.
#[test]
fn real_reports_of_nautilus_hold_what_csv_counts() {
    for (name, fills, value, fees) in
        [("ideal", 26, "740569.5494", "133.3025189"), ("lat300ms_slip30", 25, "709752.947", "127.75553046")]
    {
        let paths = ["orders", "fills"].map(|what| recorded(&format!("nautilus_example/{name}_{what}_report.csv")));
        let [Some(orders_path), Some(fills_path)] = paths else { return };
        let log = read(&[orders_path.clone(), fills_path]);
        assert_eq!((log.orders.len(), log.fills.len()), (24, fills));
        assert_eq!(sums(&log), (cash(value), cash(fees)));
        assert_eq!(log.findings.count(FindingKind::FilledOtherwise), 0);
        // Without the fills each order has one, at its average; the averages are rounded.
        let totals = read(&[orders_path]);
        assert!((sums(&totals).0.to_f64() - cash(value).to_f64()).abs() < 0.1);
        assert_eq!(sums(&totals).1, cash(fees));
    }
    let Some(folder) = recorded("nautilus_example") else { return };
    let error = import(&[folder], &ImportSettings::default()).unwrap_err().to_string();
    assert!(error.contains("these are the reports of two runs"), "{error}");
}

/// Counted with Python's `csv`: orders, those with an execution, those that work still, and what was executed last.
#[test]
fn real_tables_of_hftbacktest_hold_what_csv_counts() {
    let cases = [
        ("ioc_lat0", 689, 685, 0, "607.482"),
        ("ioc_lat200ms_partial", 383, 343, 0, "310.65"),
        ("passive_lat0_powerprob", 345, 68, 277, "34"),
        ("passive_lat50ms_riskadverse", 296, 77, 219, "38.5"),
    ];
    for (name, orders, fills, open, executed) in cases {
        let Some(path) = recorded(&format!("hftbacktest_example/{name}.csv")) else { return };
        let log = read(&[path]);
        assert_eq!((log.orders.len(), log.fills.len()), (orders, fills), "{name}");
        assert_eq!(log.orders.iter().filter(|order| order.status == Some(PaperStatus::Open)).count(), open, "{name}");
        let sum = log.fills.iter().fold(Quantity::ZERO, |sum, fill| sum + fill.quantity);
        assert_eq!(sum, quantity(executed), "{name}");
        assert_eq!(log.symbols(), [name]);
    }
}

#[test]
fn real_elements_of_flex_and_messages_of_binance_are_read() {
    let Some(folder) = recorded("execution_log_schemas") else { return };
    let log = import(&[folder.join("ibkr_flex_trade_order_elements.xml")], &new_york()).unwrap();
    assert_eq!((log.orders.len(), log.fills.len(), log.symbols()), (2, 2, vec!["EUR.USD", "IWM   210319C00226000"]));
    // An order that became another kind is of the kind that filled; what was booked without an order is none.
    assert_eq!(order(&log, "1722040385").kind, Some(OrderWords::Market));
    assert_eq!(order(&log, "1722040385").decided_at.unwrap().to_string(), "2021-02-03T15:01:50Z");
    assert_eq!(fills_of(&log, "92965807")[0].charged.clone().unwrap().amount, cash("2.557"));
    let found = |kind| log.findings.count(kind);
    assert_eq!((found(FindingKind::FeeInOtherCurrency), found(FindingKind::Multiplier)), (1, 1));
    let name = |name: &str| folder.join(format!("binance_test_data_{name}.json"));
    let log = read(&[name("spot_http_json_account_trades_response"), name("spot_http_json_all_orders_response")]);
    assert_eq!((log.orders.len(), log.fills.len()), (1, 1));
    let fill = &log.fills[0];
    assert_eq!((fill.fee, fill.currency.as_deref()), (Some(cash("40.4000101")), Some("BTC")));
    let stream = ["new", "trade", "trade_partial"].map(|what| name(&format!("futures_user_data_json_order_update_{what}")));
    let log = read(&stream);
    // Three messages of one order, of which two are one trade.
    assert_eq!((log.orders.len(), log.fills.len(), log.findings.count(FindingKind::Duplicate)), (1, 1, 1));
}

//! Names of pairs, taken apart into what is traded and what it is paid in.

/// Base and quote of a pair such as `BTC/USDT`, `BTC/USDT:USDT` or `BTC-USDT`.
pub(super) fn pair(symbol: &str) -> (Option<&str>, Option<&str>) {
    let pair = symbol.split(':').next().unwrap_or_default();
    match pair.split_once(['/', '-']) {
        Some((base, quote)) if !base.is_empty() && !quote.is_empty() && !quote.contains(['/', '-', '.']) => {
            (Some(base), Some(quote))
        }
        _ => (None, None),
    }
}

/// Base and quote of a pair without a sign between, such as `BNBBTC`, as far as the currency of a fee tells them.
pub(super) fn pair_by_fee<'a>(symbol: &'a str, fee: &str) -> (Option<&'a str>, Option<&'a str>) {
    if fee.is_empty() || fee.len() >= symbol.len() || !symbol.is_char_boundary(fee.len()) {
        return (None, None);
    }
    let (start, end) = symbol.split_at(fee.len());
    let cut = symbol.len() - fee.len();
    match (start == fee, symbol.ends_with(fee)) {
        (true, false) => (Some(start), Some(end)),
        (false, true) => (symbol.get(..cut), symbol.get(cut..)),
        _ => (None, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_taken_apart_where_they_can_be() {
        assert_eq!(pair("BTC/USDT:USDT"), (Some("BTC"), Some("USDT")));
        assert_eq!(pair("BTC-USDT"), (Some("BTC"), Some("USDT")));
        for symbol in ["BTCUSDT-PERP.BINANCE", "SPY", "", "/", "A-B-C"] {
            assert_eq!(pair(symbol), (None, None), "{symbol}");
        }
        assert_eq!(pair_by_fee("BNBBTC", "BNB"), (Some("BNB"), Some("BTC")));
        assert_eq!(pair_by_fee("BTCUSDT", "USDT"), (Some("BTC"), Some("USDT")));
        for (symbol, fee) in [("BTCUSDT", "BNB"), ("BTCUSDT", ""), ("AA", "A"), ("é", "a"), ("USDT", "USDT")] {
            assert_eq!(pair_by_fee(symbol, fee), (None, None), "{symbol} {fee}");
        }
    }
}

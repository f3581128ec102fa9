//! Order logs: orders and fills, with a line `--` between, on a tape that is fixed.

use trueup::io::{Document, TwinFile};
use trueup::market::execution_twin;

use super::scene::{Scene, shown};

const TWIN: &str = "[twin]\nmodel = 'execution'\n[assumptions]\nprice = 'mid'\n[[instrument]]\nsymbol = 'XYZ'\n\
                    tick_size = 0.01\naverage_daily_volume = 500000\ndaily_volatility = 0.009\n[market]\nquotes = 'quotes.csv'\n\
                    trades = 'trades.csv'\n";

pub fn target(scene: &Scene, bytes: &[u8]) {
    scene.once("quotes.csv", include_bytes!("../../tape/quotes.csv"));
    scene.once("trades.csv", include_bytes!("../../tape/trades.csv"));
    let cut = bytes.windows(4).position(|four| four == b"\n--\n");
    let (orders, fills) = cut.map_or((bytes, &[][..]), |at| (&bytes[..=at], &bytes[at + 4..]));
    scene.write("orders.csv", orders);
    scene.write("fills.csv", fills);
    let twin = TwinFile::parse(Document::from_text(scene.path("twin.toml"), TWIN)).expect("a twin");
    shown(execution_twin(&twin, &[scene.path("")]));
}

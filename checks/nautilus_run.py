"""The same rule in NautilusTrader (https://nautilustrader.io), an engine of events: decisions on bars, fills on quotes."""

from datetime import timedelta
from decimal import Decimal

import pandas as pd
from nautilus_trader.backtest.engine import BacktestEngine, BacktestEngineConfig
from nautilus_trader.backtest.models import LatencyModel, PerContractFeeModel
from nautilus_trader.config import LoggingConfig, RiskEngineConfig
from nautilus_trader.model.currencies import USD
from nautilus_trader.model.data import Bar, BarType, QuoteTick
from nautilus_trader.model.enums import AccountType, CurrencyType, OmsType, OrderSide
from nautilus_trader.model.identifiers import InstrumentId, Symbol, Venue
from nautilus_trader.model.instruments import Equity
from nautilus_trader.model.objects import Currency, Money, Price, Quantity
from nautilus_trader.trading.strategy import Strategy

from books import Books, Fill
from crossing import Crossing
from generated_market import TICK

VENUE = Venue("SIM")
INSTRUMENT = InstrumentId(Symbol("XYZ"), VENUE)
BARS = BarType.from_str(f"{INSTRUMENT}-1-MINUTE-LAST-EXTERNAL")
# A dollar with nine digits behind the point: amounts are rounded to what their currency has.
FINE = Currency("USDNANO", precision=9, iso4217=0, name="dollar, to 1e-9", currency_type=CurrencyType.FIAT)


def price(ticks):
    return Price(round(ticks * TICK, 2), 2)


class Rule(Strategy):
    """Decides when a bar ends. `timer` [ns]: sets one for when its order arrives; None sets none."""

    def __init__(self, rule, timer):
        super().__init__()
        self.rule = Crossing(**rule)
        self.timer = timer
        self.fills, self.worth = [], {}

    def on_start(self):
        self.subscribe_bars(BARS)

    def held(self):
        positions = self.cache.positions_open(instrument_id=INSTRUMENT)
        return positions[0] if positions else None

    def on_bar(self, bar):
        position = self.held()
        account = self.portfolio.account(VENUE)
        equity = account.balance_total(account.base_currency).as_double()
        if position is not None:
            equity += position.unrealized_pnl(bar.close).as_double()
        self.worth[bar.ts_event] = equity
        held = round(position.signed_qty) if position is not None else 0
        close = bar.close.as_double()
        signed = self.rule.order(round(close / TICK), close, held, equity)
        if signed == 0:
            return
        side = OrderSide.BUY if signed > 0 else OrderSide.SELL
        self.submit_order(self.order_factory.market(INSTRUMENT, side, Quantity.from_int(abs(signed))))
        if self.timer is not None:
            at = pd.Timestamp(bar.ts_event + self.timer, unit="ns", tz="UTC")
            self.clock.set_time_alert(f"arrival {bar.ts_event}", at, lambda event: None)

    def on_order_filled(self, event):
        side = "buy" if event.order_side == OrderSide.BUY else "sell"
        numbers = (event.last_qty, event.last_px, event.commission)
        self.fills.append(Fill(event.ts_event, side, *(number.as_double() for number in numbers)))


def run(bars, quotes, rule, cash, *, latency, bps=0, per_share=None, fine=True, timer=True):
    """The books of the rule, whose orders arrive `latency` [ns] after the bar they were decided on.

    - `fine`: amounts have nine digits behind the point, and not the two of USD;
    - `timer`: the strategy sets a timer for when its order arrives. Without one the engine lets orders under way meet the
      market when the next data come, after these.
    """
    currency = FINE if fine else USD
    fees = None if per_share is None else PerContractFeeModel(Money(per_share, currency))
    engine = BacktestEngine(
        BacktestEngineConfig(logging=LoggingConfig(bypass_logging=True), risk_engine=RiskEngineConfig(bypass=True))
    )
    engine.add_venue(
        venue=VENUE,
        oms_type=OmsType.NETTING,
        account_type=AccountType.MARGIN,
        base_currency=currency,
        starting_balances=[Money(cash, currency)],
        fee_model=fees,
        latency_model=LatencyModel(base_latency_nanos=latency),
        bar_execution=False,
    )
    rate = Decimal(bps) / 10_000
    engine.add_instrument(
        Equity(INSTRUMENT, Symbol("XYZ"), currency, 2, Price.from_str("0.01"), Quantity.from_int(1), 0, 0, maker_fee=rate,
               taker_fee=rate)
    )
    engine.add_data([
        QuoteTick(INSTRUMENT, price(q.bid), price(q.ask), Quantity.from_int(q.bid_size), Quantity.from_int(q.ask_size),
                  q.time, q.time)
        for q in quotes
    ])
    engine.add_data([
        Bar(BARS, price(b.open), price(b.high), price(b.low), price(b.close), Quantity.from_int(b.volume), b.close_at,
            b.close_at)
        for b in bars
    ])
    strategy = Rule(rule, latency if timer else None)
    engine.add_strategy(strategy)
    engine.run()
    books = Books(strategy.fills, strategy.worth)
    engine.dispose()
    return books

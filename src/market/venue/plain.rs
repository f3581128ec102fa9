//! A market order that meets the next open alone.

use crate::market::{Bar, InFlight, OrderId, Price, Quantity, Reason, Role, Side};

use super::floor::Floor;
use super::taken::Taken;
use super::{Filled, What};

impl Floor {
    /// Whether a market order that finds nobody here is only ever filled at the next open: bars alone, that always trade, no law
    /// that shapes orders, and none by which they move the market.
    pub fn can_be_plain(&self) -> bool {
        self.by_bars && self.auctions.is_none() && self.moved.is_never() && self.run.leaves_commands()
    }

    /// Whether nobody waits here, and nothing is to be filled otherwise than it would be.
    #[inline]
    pub fn is_alone(&self) -> bool {
        self.resting.is_empty() && self.outcomes.is_empty() && self.instead.is_empty()
    }

    /// Whether no law has anything to say here.
    pub fn is_bare(&self) -> bool {
        self.run.is_bare()
    }

    /// A market order for `quantity`, whole lots, arrives where [nobody waits](Self::is_alone) and meets the open of `bar`, the next:
    /// what [`arrive`](Self::arrive) and [`on_open`](Self::on_open) make of it, in one. Where it is filled whole, its fill; else what
    /// became of it is among the outcomes, as ever. How it was `decided` need not be known where [no law](Self::is_bare) asks.
    #[inline]
    pub fn meet_open(
        &mut self,
        id: OrderId,
        side: Side,
        quantity: Quantity,
        bar: &Bar,
        row: usize,
        decided: Option<&InFlight>,
    ) -> Option<Filled> {
        // The message by which it was sent, which no law shapes.
        self.messages += 1;
        self.at_row(0, row);
        self.taken = Taken::of_bars();
        let offer = self.offer(bar, bar.open_at, bar.open);
        let (model_price, met, fee) = match decided {
            Some(order) => {
                let arriving = InFlight { quantity: quantity.to_f64(), ..order.as_a(Role::Taker) };
                self.met_whole_lots(&arriving, &offer, quantity)
            }
            None => {
                // Nothing limits it, moves its price or charges it.
                self.messages += 1;
                (offer.reference, quantity, 0.0)
            }
        };
        let filled = (met > Quantity::ZERO).then(|| {
            self.taken.add(side, met.to_f64());
            self.held = self.held + met.signed(side);
            Filled {
                role: Role::Taker,
                quantity: met,
                price: self.rounded(side, model_price),
                model_price,
                mid: offer.mid,
                fee,
                queued_behind: 0.0,
                row: offer.row,
                band: offer.band,
                displaced: self.moved.by(),
            }
        });
        match filled {
            Some(filled) if met == quantity && filled.price > Price(0) && model_price.is_finite() => return Some(filled),
            Some(filled) => {
                self.terms.extend_from_slice(&self.concessions);
                self.tell(id, offer.at, What::Filled(filled));
            }
            None => {}
        }
        if met < quantity {
            self.tell(id, offer.at, What::Ended(Reason::NoVolume));
        }
        None
    }

    /// What each mechanism that acts on prices added to the price of the last fill [currency].
    pub fn concessions(&self) -> &[f64] {
        &self.concessions
    }
}

//! What drives the plant: the rows of a log, and what each meets on the tape.

use crate::market::log_rows::Made;
use crate::market::queue_place::Place;
use crate::market::{Book, Execution, InFlight, Met, Role, Seen, Side};
use crate::sim2real::Stimulus;

use super::aspects::Aspect;
use super::{OrderLog, Row, above};

impl Stimulus<Execution> for OrderLog {
    fn command(&self, row: usize) -> InFlight {
        match self.rows[row] {
            Row::Order(number) => self.orders[number],
            Row::Made(number) => self.made(number).0,
            Row::Queued(number) => self.places[number].order,
            Row::Look(look) => InFlight::market(Side::Buy, 0.0, look.at, look.mid, look.mid).as_a(Role::Watcher),
        }
    }

    fn input(&self, row: usize, arriving: &InFlight) -> Met {
        match self.rows[row] {
            Row::Order(number) => match self.paid[number].filter(|_| self.aspect == Aspect::Fees) {
                // What is charged is charged for what was paid, whatever it should have been.
                Some(price) => Met::at(Book::at_price(arriving.decided_at, price), price, f64::INFINITY),
                None => self.met(number, arriving),
            },
            Row::Made(number) => {
                let (order, price) = self.made(number);
                Met::at(Book::at_price(order.decided_at, price), price, f64::INFINITY)
            }
            Row::Queued(number) => {
                let Place { order, displayed, .. } = self.places[number];
                let at = Met::at(Book::at_price(order.decided_at, order.assumed), order.assumed, f64::INFINITY);
                Met { displayed, ..at }
            }
            Row::Look(look) => {
                let nothing = Met::at(Book::at_price(look.at, look.mid), look.mid, 0.0);
                Met { scatter: look.scatter, shows_own: self.shows_own_orders, ..nothing }
            }
        }
    }
}

impl OrderLog {
    /// The fill of that number of an order that rested, and its price [currency]; where fees are looked at, all the fills of its order.
    fn made(&self, number: usize) -> (InFlight, f64) {
        let Made { order, price, charged } = self.made[number];
        match charged.filter(|_| self.aspect == Aspect::Fees) {
            Some(charged) => (InFlight { quantity: charged.quantity, ..order }, charged.price()),
            None => (order, price),
        }
    }

    /// What order `number` meets as it arrives.
    fn met(&self, number: usize, arriving: &InFlight) -> Met {
        let seen = Seen::by(arriving, self.met_at[number]);
        let tape = self.tape();
        let decided_at = self.orders[number].decided_at;
        let quote = match self.known.get(number) {
            Some(known) if arriving.decided_at == decided_at => tape.quote_after(*known as usize, seen),
            _ => tape.quote(seen),
        };
        // Where the tape has ended or shows one side only, the assumption stays as it was at the decision.
        let price = self.market.price.price_beside(quote, tape, arriving.side, seen);
        let reference = price.unwrap_or(arriving.assumed);
        // What rests joins the best price of its own side.
        let own_side = arriving.side.opposite();
        let joined = match &quote {
            _ if arriving.role != Role::Maker => None,
            Some(quote) => quote.opposite(own_side).first().map(|level| level.size),
            None => Some(f64::INFINITY),
        };
        Met {
            book: quote.map_or_else(|| Book::at_price(seen.end(), reference), |quote| quote.book()),
            reference,
            volume: tape.volume_beside(quote, arriving.side, seen),
            displayed: joined.unwrap_or(0.0),
            seen: self.moved_since_seen(arriving),
            shows_own: self.shows_own_orders,
            scatter: f64::INFINITY,
        }
    }

    /// The mid that had been seen when `order` was decided, above what the mid was then [bps].
    fn moved_since_seen(&self, order: &InFlight) -> f64 {
        // A log that does not say what was seen is not asked: looking up costs time.
        if self.shown_age.is_none() || order.seen_until == order.decided_at {
            return 0.0;
        }
        self.tape().mid(Seen::at(order.seen_until)).map_or(0.0, |mid| above(mid, order.mid))
    }
}

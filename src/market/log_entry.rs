//! Rows of an order log, held to what every log obeys.

use std::collections::HashMap;
use std::fmt;

use crate::sim2real::Timestamp;

use super::Side;

/// What kind of order it was.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OrderType {
    /// Takes what there is.
    Market,
    /// Any other, by the log's word for it.
    Other(String),
}

/// A row of `orders`.
#[derive(Debug, Clone, PartialEq)]
pub struct LoggedOrder {
    /// Id, unique within the log.
    pub id: String,
    /// Which way it trades.
    pub side: Side,
    /// Quantity [units].
    pub quantity: f64,
    /// When it was decided.
    pub decided_at: Timestamp,
    /// What kind of order it was.
    pub kind: OrderType,
    /// Mid of the quote it was decided on [currency], where the log says which that was.
    pub seen_mid: Option<f64>,
}

/// A row of `fills`.
#[derive(Debug, Clone, PartialEq)]
pub struct LoggedFill {
    /// Id of the order it belongs to.
    pub order_id: String,
    /// When it was reported.
    pub filled_at: Timestamp,
    /// Quantity [units].
    pub quantity: f64,
    /// Price [currency].
    pub price: f64,
    /// Fee [currency]; negative for a rebate.
    pub fee: f64,
}

/// A table of a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LogTable {
    /// `orders`.
    Orders,
    /// `fills`.
    Fills,
}

impl fmt::Display for LogTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Orders => "orders",
            Self::Fills => "fills",
        })
    }
}

/// An order log that cannot be used: where, what was found there, and what to do about it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub struct LogError {
    /// The table it is in.
    pub table: LogTable,
    /// Data row of the table, from 0, and column; none where the table as a whole is meant.
    pub cell: Option<(usize, &'static str)>,
    /// What is wrong.
    pub message: String,
    /// The value found.
    pub found: Option<String>,
    /// What to do about it.
    pub hint: String,
}

impl fmt::Display for LogError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.table)?;
        if let Some((row, column)) = self.cell {
            write!(f, ": row {}, column `{column}`", row + 1)?;
        }
        write!(f, ": {}", self.message)?;
        if let Some(found) = &self.found {
            write!(f, ", found {found}")?;
        }
        write!(f, "\n  hint: {}", self.hint)
    }
}

impl LogError {
    /// An error of a whole table.
    pub(super) fn of(table: LogTable, message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { table, cell: None, message: message.into(), found: None, hint: hint.into() }
    }

    fn at(mut self, row: usize, column: &'static str, found: impl fmt::Display) -> Self {
        self.cell = Some((row, column));
        self.found = Some(found.to_string());
        self
    }
}

/// The fills of each order, in order of time: `fills[k]` belongs to `orders[k]`.
///
/// # Errors
/// No orders; an order id used twice; a quantity or price that is not above 0; a fee that is not a number; a fill of an
/// unknown order, before its order was decided, or beyond its order's quantity.
pub fn fills_of_orders<'a>(orders: &[LoggedOrder], fills: &'a [LoggedFill]) -> Result<Vec<Vec<&'a LoggedFill>>, LogError> {
    let numbers = numbers_of_orders(orders)?;
    let mut of_order: Vec<Vec<&LoggedFill>> = vec![Vec::new(); orders.len()];
    let mut filled = vec![0.0; orders.len()];
    let fail = |message: &str, hint: &str| LogError::of(LogTable::Fills, message, hint);
    for (row, fill) in fills.iter().enumerate() {
        let Some(number) = numbers.get(fill.order_id.as_str()).copied() else {
            return Err(fail("there is no such order", "each fill names a row of orders: are both files of one log?").at(
                row,
                "order_id",
                format_args!("{:?}", fill.order_id),
            ));
        };
        above_zero(fill.quantity, LogTable::Fills, row, "qty")?;
        above_zero(fill.price, LogTable::Fills, row, "price")?;
        if !fill.fee.is_finite() {
            return Err(fail("expected a number", "write 0 where nothing was charged").at(row, "fee", fill.fee));
        }
        let order = &orders[number];
        if fill.filled_at < order.decided_at {
            let early = order.decided_at.seconds_since(fill.filled_at);
            return Err(fail(
                &format!("order {:?} is filled {early:.9} s before it was decided ({})", order.id, order.decided_at),
                "are both columns in the same zone and unit, and from the same clock?",
            )
            .at(row, "filled_at", fill.filled_at));
        }
        filled[number] += fill.quantity;
        if filled[number] > order.quantity * (1.0 + 1e-9) {
            return Err(fail(
                &format!("the fills of order {:?} add up to {}, more than its {}", order.id, filled[number], order.quantity),
                "is `qty` the quantity of each fill, not the sum so far? Are rows doubled?",
            )
            .at(row, "qty", fill.quantity));
        }
        of_order[number].push(fill);
    }
    of_order.iter_mut().for_each(|fills| fills.sort_by_key(|fill| fill.filled_at));
    Ok(of_order)
}

fn numbers_of_orders(orders: &[LoggedOrder]) -> Result<HashMap<&str, usize>, LogError> {
    let mut numbers = HashMap::with_capacity(orders.len());
    for (row, order) in orders.iter().enumerate() {
        above_zero(order.quantity, LogTable::Orders, row, "qty")?;
        if let Some(first) = numbers.insert(order.id.as_str(), row) {
            return Err(LogError::of(
                LogTable::Orders,
                format!("the id is that of data row {} too", first + 1),
                "each order has an id of its own; are rows doubled, or days put together that count from 1 again?",
            )
            .at(row, "order_id", format_args!("{:?}", order.id)));
        }
    }
    if numbers.is_empty() {
        return Err(LogError::of(LogTable::Orders, "there are no orders", "a log needs at least one row"));
    }
    Ok(numbers)
}

fn above_zero(value: f64, table: LogTable, row: usize, column: &'static str) -> Result<(), LogError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    let hint = match column {
        "qty" => "quantities are above 0; which way an order trades is said by its side",
        _ => "prices are above 0: drop the row, or write what was paid",
    };
    Err(LogError::of(table, "expected a number above 0", hint).at(row, column, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order(id: &str) -> LoggedOrder {
        LoggedOrder {
            id: id.into(),
            side: Side::Buy,
            quantity: 10.0,
            decided_at: Timestamp(1_000_000_000),
            kind: OrderType::Market,
            seen_mid: None,
        }
    }

    fn fill(id: &str, at: i64, quantity: f64) -> LoggedFill {
        LoggedFill { order_id: id.into(), filled_at: Timestamp(at), quantity, price: 100.0, fee: 0.0 }
    }

    fn error(orders: &[LoggedOrder], fills: &[LoggedFill]) -> String {
        fills_of_orders(orders, fills).unwrap_err().to_string()
    }

    #[test]
    fn fills_come_to_their_orders_in_order_of_time() {
        let fills = [fill("b", 3_000_000_000, 4.0), fill("a", 1_000_000_000, 10.0), fill("b", 2_000_000_000, 6.0)];
        let of_order = fills_of_orders(&[order("a"), order("b"), order("c")], &fills).unwrap();
        let quantities: Vec<Vec<f64>> = of_order.iter().map(|f| f.iter().map(|f| f.quantity).collect()).collect();
        assert_eq!(quantities, [vec![10.0], vec![6.0, 4.0], vec![]]);
    }

    #[test]
    fn what_no_log_can_hold_is_said_with_its_place() {
        let a = [order("a")];
        let later = 2_000_000_000;
        insta::assert_snapshot!(error(&a, &[fill("a", later, 1.0), fill("x", later, 1.0)]), @r#"
        fills: row 2, column `order_id`: there is no such order, found "x"
          hint: each fill names a row of orders: are both files of one log?
        "#);
        insta::assert_snapshot!(error(&a, &[fill("a", 999_999_900, 1.0)]), @r#"
        fills: row 1, column `filled_at`: order "a" is filled 0.000000100 s before it was decided (1970-01-01T00:00:01Z), found 1970-01-01T00:00:00.999999900Z
          hint: are both columns in the same zone and unit, and from the same clock?
        "#);
        insta::assert_snapshot!(error(&a, &[fill("a", later, 6.0), fill("a", later, 5.0)]), @r#"
        fills: row 2, column `qty`: the fills of order "a" add up to 11, more than its 10, found 5
          hint: is `qty` the quantity of each fill, not the sum so far? Are rows doubled?
        "#);
        insta::assert_snapshot!(error(&[order("a"), order("a")], &[]), @r#"
        orders: row 2, column `order_id`: the id is that of data row 1 too, found "a"
          hint: each order has an id of its own; are rows doubled, or days put together that count from 1 again?
        "#);
        assert!(error(&a, &[fill("a", later, -1.0)]).contains("row 1, column `qty`: expected a number above 0, found -1"));
        let free = LoggedFill { price: 0.0, ..fill("a", later, 1.0) };
        assert!(error(&a, &[free]).contains("column `price`: expected a number above 0, found 0"));
        let unknown = LoggedFill { fee: f64::NAN, ..fill("a", later, 1.0) };
        assert!(error(&a, &[unknown]).contains("column `fee`"));
        assert!(error(&[LoggedOrder { quantity: 0.0, ..order("a") }], &[]).contains("orders: row 1, column `qty`"));
        assert!(error(&[], &[]).contains("no orders"));
    }
}

//! Every form of every row of the registry, changed on the way: with other parameters, anew, and as another.

use super::MECHANISMS;
use super::schedule::{DAILY, MID};
use crate::market::{Book, Execution, ExecutionEffect, InFlight, Level, Met, Report, Role, Side};
use crate::sim2real::{
    Dynamics, Form, LaneChange, LaneImage, Law, Mechanism, Parameter, Scene, Seed, Thetas, Tick, Timestamp, Typical,
};

/// Orders that take and that rest, looks at the mid and positions of more than a day, at uneven times [s].
fn orders() -> Vec<(f64, InFlight)> {
    let roles =
        [Role::Taker, Role::Watcher, Role::Maker, Role::Taker, Role::Watcher, Role::Holder, Role::Maker, Role::Holder];
    let order = |k: usize| {
        let time = 1.7 * k as f64 + 0.3 * (k % 3) as f64;
        let side = if k % 5 < 3 { Side::Buy } else { Side::Sell };
        let at = Timestamp(0).plus_seconds(72_000.0 + time);
        let role = roles[k % roles.len()];
        let under_way = if role == Role::Holder { 144_000.0 } else { 0.25 };
        let quantity = 900.0 + 1_700.0 * (k % 4) as f64;
        let order = InFlight {
            average_daily_volume: Some(DAILY),
            daily_volatility: Some(0.02),
            recent_volatility: Some(0.001),
            ..InFlight::market(side, quantity, at, MID, MID)
        };
        (time, order.as_a(role).arriving(at.plus_seconds(under_way)))
    };
    (0..32).map(order).collect()
}

/// What such an order meets: a book of three levels, and a queue.
fn met(order: &InFlight) -> Met {
    let levels = |away: f64| [1.0, 2.0, 4.0].map(|step| Level { price: MID + away * step, size: 800.0 * step });
    let book = Book::new(order.arrives_at, &levels(-0.01), &levels(0.01));
    Met { displayed: 300.0, ..Met::at(book, MID, 5_000.0) }
}

/// What each of `lanes` lanes of `law` does to each order, in words: they tell numbers apart to the last bit.
fn run(law: &mut dyn Law<Execution>, lanes: usize, orders: &[(f64, InFlight)]) -> Vec<Vec<String>> {
    let states = Execution.initial(&Thetas::from_lanes(&vec![[0.0; 0]; lanes]));
    let mut seen = vec![Vec::new(); lanes];
    for (index, (time, order)) in orders.iter().enumerate() {
        let tick = Tick { index, time: *time, step: 0.0 };
        let mut commands = vec![*order; lanes];
        law.shape(tick, &mut commands);
        let inputs = vec![met(order); lanes];
        let mut effects = vec![ExecutionEffect::default(); lanes];
        let scene = Scene { dynamics: &Execution, states: &states, inputs: &inputs, commands: &commands };
        law.act(tick, &scene, &mut effects);
        let mut reports = vec![Report::of(order, MID, order.quantity); lanes];
        law.sense(*time, &mut reports);
        for (lane, seen) in seen.iter_mut().enumerate() {
            seen.push(format!("{:?} {:?} {:?}", commands[lane], effects[lane], reports[lane]));
        }
    }
    seen
}

/// Values at which a form acts.
fn acting(form: &Form, share: f64) -> Vec<f64> {
    let value = |p: &Parameter| p.starts.last().copied().unwrap_or(0.5 * p.upper);
    form.parameters.iter().map(|p| (share * value(p)).clamp(p.lower, p.upper)).collect()
}

/// A form of the registry, two points of its parameters, and what it is called.
struct Case {
    mechanism: &'static dyn Mechanism<Execution>,
    form: usize,
    own: Vec<f64>,
    other: Vec<f64>,
    name: String,
}

impl Case {
    /// Its law with lanes at these points.
    fn law(&self, points: &[&[f64]], seed: u64) -> Box<dyn Law<Execution>> {
        self.mechanism.law(self.form, &Thetas::from_lanes(points), Seed(seed))
    }
}

/// Every form, from values that do nothing and from such that do something.
fn cases() -> Vec<Case> {
    let of_form = |mechanism: &'static dyn Mechanism<Execution>, form: usize, stated: &Form| {
        let nominal: Vec<f64> = stated.parameters.iter().map(|p| p.nominal).collect();
        let name = format!("{} `{}`", mechanism.about().name, stated.name);
        [nominal, acting(stated, 1.0)].map(|own| Case {
            mechanism,
            form,
            own,
            other: acting(stated, 0.8),
            name: name.clone(),
        })
    };
    let of_mechanism = |mechanism: &&'static dyn Mechanism<Execution>| -> Vec<Case> {
        let forms = mechanism.forms(&Typical::default());
        forms.iter().enumerate().flat_map(|(form, stated)| of_form(*mechanism, form, stated)).collect()
    };
    MECHANISMS.iter().flat_map(of_mechanism).collect()
}

fn retune(law: &mut dyn Law<Execution>, lane: usize, values: &[f64]) {
    law.change(&LaneChange::Retune { lane, values });
}

#[test]
fn retuned_before_any_order_a_law_is_the_one_that_was_made_so() {
    for case in cases() {
        let (own, other) = (&case.own[..], &case.other[..]);
        let made = run(case.law(&[own, other], 1).as_mut(), 2, &orders());
        let mut law = case.law(&[own, own], 1);
        retune(law.as_mut(), 1, other);
        assert!(run(law.as_mut(), 2, &orders()) == made, "{}", case.name);
        assert!(made[0] != made[1], "{}: the values make no difference", case.name);
    }
}

#[test]
fn there_and_back_changes_nothing_and_there_alone_one_lane_from_then_on() {
    let (orders, half) = (orders(), 16);
    for case in cases() {
        let (own, other) = (&case.own[..], &case.other[..]);
        let mut law = case.law(&[own, own], 1);
        run(law.as_mut(), 2, &orders[..half]);
        let (mut there, mut back) = (law.clone(), law.clone());
        let kept = run(law.as_mut(), 2, &orders[half..]);
        retune(back.as_mut(), 1, other);
        retune(back.as_mut(), 1, own);
        assert!(run(back.as_mut(), 2, &orders[half..]) == kept, "{}", case.name);
        retune(there.as_mut(), 1, other);
        let changed = run(there.as_mut(), 2, &orders[half..]);
        assert!(changed[0] == kept[0], "{}: the lane beside it changes", case.name);
        assert!(changed[1] != kept[1], "{}: the values make no difference", case.name);
    }
}

#[test]
fn a_law_begins_anew_as_it_begins_and_goes_on_as_the_one_it_was_copied_from() {
    let (orders, half) = (orders(), 16);
    for case in cases() {
        let mut law = case.law(&[&case.own], 1);
        run(law.as_mut(), 1, &orders[..half]);
        let mut copy = case.law(&[&case.other], 2);
        run(copy.as_mut(), 1, &orders[..half / 2]);
        let image = LaneImage::default();
        law.change(&LaneChange::Save { lane: 0, image: &image });
        copy.change(&LaneChange::Load { lane: 0, image: &image });
        let goes_on = run(law.as_mut(), 1, &orders[half..]);
        assert!(run(copy.as_mut(), 1, &orders[half..]) == goes_on, "{}: as a copy", case.name);
        law.change(&LaneChange::Forget { lane: 0, seed: Seed(3) });
        let anew = run(case.law(&[&case.own], 3).as_mut(), 1, &orders);
        assert!(run(law.as_mut(), 1, &orders) == anew, "{}: anew", case.name);
    }
}

//! Pursuit: another mechanism in the place of one, followed for as long as it may yet do as well.

use super::hypothesis::{Hypothesis, Inquiry};
use super::order::in_either_order;
use super::screen::Screened;
use super::weigh::lead;
use crate::sim2real::Twin;
use crate::sim2real::identify::Effort;

/// What stands behind by more than this after a few steps is not followed further, ...
pub(super) const HOPELESS: f64 = 300.0;
/// ... unless a few steps more leave it behind by no more than this part of that.
const CATCHES_UP: f64 = 0.7;

/// `less`, which is a part of `best`, with another candidate: fitted to its end if it comes near `best` in a few steps, or in a few more
/// for as long as it catches up.
pub(super) fn pursued<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    first: &Hypothesis<T>,
    best: &Hypothesis<T>,
    less: &Hypothesis<T>,
    one: &Screened,
) -> Hypothesis<T> {
    let mut briefly = in_either_order(inquiry, inquiry.instead(best, less, one, Effort::Brief), Effort::Brief);
    let mut behind = lead(inquiry, first, best, &briefly);
    while behind >= HOPELESS {
        let further = inquiry.followed_on(&briefly, Effort::Brief);
        let now = lead(inquiry, first, best, &further);
        // What ran away is behind by no number.
        if now.is_nan() || now > CATCHES_UP * behind {
            return briefly;
        }
        (briefly, behind) = (further, now);
    }
    inquiry.refitted(&briefly)
}

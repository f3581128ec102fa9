//! Bounds as a JUnit report, which test servers read.

use std::fmt::Write as _;

use quick_xml::escape::escape;

use crate::market::reconcile::{Checked, Reconciliation};

/// A test case a bound. Source: the schema that Jenkins and GitLab read (`testsuites/testsuite/testcase/failure`).
pub(super) fn junit(found: &Reconciliation, checked: &[Checked]) -> String {
    let failures = checked.iter().filter(|checked| !checked.holds).count();
    let count = checked.len();
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites tests=\"{count}\" failures=\"{failures}\">\n  \
         <testsuite name=\"trueup reconcile\" tests=\"{count}\" failures=\"{failures}\">\n"
    );
    for Checked { key, bound, found: largest, holds, order } in checked {
        let _ = write!(text, "    <testcase classname=\"trueup.reconcile\" name=\"{}\"", escape(*key));
        if *holds {
            text += "/>\n";
            continue;
        }
        let largest = largest.map_or_else(|| "nothing to compare".to_owned(), |largest| largest.to_string());
        let of = order.as_ref().map_or_else(String::new, |order| format!(" (order {order})"));
        let message = format!("{largest}{of}, beyond {bound}");
        let _ = writeln!(
            text,
            ">\n      <failure message=\"{}\">{}</failure>\n    </testcase>",
            escape(&message),
            escape(&found.summary)
        );
    }
    text + "  </testsuite>\n</testsuites>\n"
}

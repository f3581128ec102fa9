//! What pages are made of in these tests: a diagnosis and a backtest from synthetic data, and what holds for every page.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails where a value is missing")]

mod backtest;
mod diagnosis;

use std::fs;
use std::path::Path;

pub use backtest::backtest;
pub use diagnosis::{advice, market_page, servo_diagnosis, servo_figures, servo_trace};

/// A page must stay below this [bytes].
const MOST: usize = 1_500_000;

/// A small, fixed generator: these tests need noise, not quality.
pub struct Noise(pub u64);

impl Noise {
    /// About Gaussian, standard deviation 1.
    pub fn next(&mut self) -> f64 {
        let mut sum = 0.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum - 6.0
    }
}

/// What holds for every page.
pub fn check(name: &str, page: &str) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report");
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join(name), page).unwrap();

    assert!(page.len() < MOST, "{name}: {} bytes", page.len());
    for fetches in ["<script", "<link", "<img", "<iframe", "<object", "src=", "@import", "http://", "https://", "url(h"] {
        assert!(!page.contains(fetches), "{name} contains `{fetches}`");
    }
    for wrong in ["NaN", "inf ", "undefined", "{{", "{%"] {
        let at = page.find(wrong);
        assert!(at.is_none(), "{name}: `{wrong}` in {:?}", at.map(|i| page.get(i.saturating_sub(80)..i + 20)));
    }
    balanced(name, page);
    let ids: Vec<&str> = page.split(" id=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    let mut once = ids.clone();
    once.sort_unstable();
    once.dedup();
    assert_eq!(once.len(), ids.len(), "{name}: an id is there twice");
    for target in page.split("url(#").skip(1).filter_map(|rest| rest.split(')').next()) {
        assert!(once.binary_search(&target).is_ok(), "{name}: no clip path {target}");
    }
    for svg in page.split("<svg").skip(1) {
        let head = svg.split('>').next().unwrap();
        assert!(head.contains("role=\"img\"") && head.contains("aria-label=\""), "{name}: a plot without a description");
    }
    assert_eq!(page.matches("<table").count(), page.matches("<thead").count(), "{name}: a table without headers");
}

/// Every element that is opened is closed, in order.
pub fn balanced(name: &str, page: &str) {
    let mut open: Vec<&str> = vec!["html", "head"];
    let body = page.split("</style>").nth(1).unwrap();
    for tag in body.split('<').skip(1) {
        let (head, _) = tag.split_once('>').unwrap_or_else(|| panic!("{name}: `<{}` never ends", &tag[..tag.len().min(60)]));
        let element = head.trim_start_matches('/').split([' ', '/']).next().unwrap();
        if head.starts_with('/') {
            assert_eq!(open.pop(), Some(element), "{name}: </{element}> closes something else");
        } else if !head.ends_with('/') && !["br", "meta"].contains(&element) {
            open.push(element);
        }
    }
    assert!(open.is_empty(), "{name}: {open:?} never closed");
}

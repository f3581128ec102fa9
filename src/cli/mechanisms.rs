//! `trueup mechanisms`: what can be found missing.

use clap::Args;
use serde::Serialize;

use crate::market::{self, Execution};
use crate::report::quantity::number;
use crate::robot::{
    CART_POLE_MECHANISMS, CartPole, EQUATIONS_MECHANISMS, Equations, Joint, MECHANISMS, TANKS_MECHANISMS, Tanks,
};
use crate::sim2real::{About, Parameter, Plant, Registry, Site};

use super::screen::Screen;
use super::stop::{Outcome, Stop};

/// List the mechanisms that can be found missing, with their laws, parameters and sources
///
/// The units `command` and `output` stand for those of the columns a recording has its commands and its first channel in.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup mechanisms
  trueup mechanisms --json | python3 -m json.tool")]
pub(super) struct Mechanisms {
    /// Print JSON (schema trueup.mechanisms/1) instead of a table; a bound that is infinite is null
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Listing {
    schema: &'static str,
    mechanisms: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    id: &'static str,
    domains: Vec<&'static str>,
    /// The models of twins it can be found missing in.
    plants: Vec<&'static str>,
    site: Site,
    title: &'static str,
    law: &'static str,
    source: &'static str,
    remedy: &'static str,
    contains: &'static [&'static str],
    forms: Vec<FormRow>,
}

/// A form, in the domains that state it in this way.
#[derive(Serialize)]
struct FormRow {
    name: &'static str,
    domains: Vec<&'static str>,
    parameters: Vec<ParameterRow>,
}

#[derive(Serialize, PartialEq)]
struct ParameterRow {
    name: String,
    unit: String,
    nominal: Option<f64>,
    lower: Option<f64>,
    upper: Option<f64>,
}

impl Mechanisms {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let rows = rows();
        let text = if self.json {
            let listing = Listing { schema: "trueup.mechanisms/1", mechanisms: rows };
            format!("{}\n", serde_json::to_string_pretty(&listing)?)
        } else {
            table(screen, &rows)
        };
        screen.print(&text)?;
        Ok(Outcome::Done)
    }
}

/// The registries of all plants, merged by id, in the order of the sites.
fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    add::<Joint>(&mut rows, "robot", "joint", MECHANISMS);
    add::<CartPole>(&mut rows, "robot", "cart_pole", CART_POLE_MECHANISMS);
    add::<Tanks>(&mut rows, "robot", "tanks", TANKS_MECHANISMS);
    add::<Equations>(&mut rows, "robot", "equations", EQUATIONS_MECHANISMS);
    add::<Execution>(&mut rows, "market", "execution", market::MECHANISMS);
    rows.sort_by_key(|row| match row.site {
        Site::Command => 0,
        Site::Plant => 1,
        Site::Observation => 2,
    });
    rows
}

fn add<P: Plant>(rows: &mut Vec<Row>, domain: &'static str, plant: &'static str, registry: Registry<P>) {
    for mechanism in registry {
        let about = mechanism.about();
        let at = rows.iter().position(|row| row.id == about.name).unwrap_or_else(|| {
            rows.push(row(about));
            rows.len() - 1
        });
        let row = &mut rows[at];
        note(&mut row.domains, domain);
        note(&mut row.plants, plant);
        for form in mechanism.forms(&Default::default()) {
            let parameters: Vec<ParameterRow> = form.parameters.iter().map(parameter).collect();
            match row.forms.iter_mut().find(|known| known.name == form.name && known.parameters == parameters) {
                Some(known) => note(&mut known.domains, domain),
                None => row.forms.push(FormRow { name: form.name, domains: vec![domain], parameters }),
            }
        }
    }
}

fn note(names: &mut Vec<&'static str>, name: &'static str) {
    if !names.contains(&name) {
        names.push(name);
    }
}

fn row(about: About) -> Row {
    Row {
        id: about.name,
        domains: Vec::new(),
        plants: Vec::new(),
        site: about.site,
        title: about.title,
        law: about.law,
        source: about.source,
        remedy: about.remedy,
        contains: about.contains,
        forms: Vec::new(),
    }
}

fn parameter(parameter: &Parameter) -> ParameterRow {
    let finite = |value: f64| value.is_finite().then_some(value);
    ParameterRow {
        name: parameter.name.clone().into_owned(),
        unit: parameter.unit.clone().into_owned(),
        nominal: finite(parameter.nominal),
        lower: finite(parameter.lower),
        upper: finite(parameter.upper),
    }
}

fn table(screen: &Screen, rows: &[Row]) -> String {
    let mut table = screen.table(["mechanism", "site", "models", "parameters", "law; source"]);
    for row in rows {
        let forms: Vec<String> = row.forms.iter().map(|form| told(form, row.domains.len())).collect();
        table.add_row([
            row.id.to_owned(),
            row.site.to_string(),
            row.plants.join(", "),
            forms.join("\nor "),
            format!("{}; {}", row.law, row.source),
        ]);
    }
    format!("{}\n", table.trim_fmt())
}

/// A form's parameters: name, unit and bounds; and its domain where the other has it otherwise.
fn told(form: &FormRow, domains: usize) -> String {
    let one = |p: &ParameterRow| {
        let unit = if p.unit.is_empty() { String::new() } else { format!(" [{}]", p.unit) };
        let bounds = match (p.lower, p.upper) {
            (None, None) => String::new(),
            (Some(lower), None) => format!(" from {}", number(lower)),
            (None, Some(upper)) => format!(" up to {}", number(upper)),
            (Some(lower), Some(upper)) => format!(" {} to {}", number(lower), number(upper)),
        };
        format!("{}{unit}{bounds}", p.name)
    };
    let parameters: Vec<String> = form.parameters.iter().map(one).collect();
    let domain = if form.domains.len() < domains { format!(" ({})", form.domains.join(", ")) } else { String::new() };
    format!("{}{domain}", parameters.join(", "))
}

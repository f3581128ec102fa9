//! The page of a diagnosis.

use crate::sim2real::diagnose::{Diagnosis, Verdict};

use super::figures::DiagnosisFigures;
use super::page::{Badge, Page, Tone};
use super::section::ReportError;
use super::sections::{Answer, Checks, Effects, Errors, Next, Orders, Parameters, Place, Ranking, Traces};

/// The report of a diagnosis as one HTML file: what is missing, how sure that is and how much better the trued twin is;
/// then where, why not something else, the parameters, the proof, and what to record next.
///
/// # Errors
/// If a template cannot be rendered.
pub fn diagnosis_page(diagnosis: &Diagnosis, figures: &DiagnosisFigures) -> Result<String, ReportError> {
    let traces = |held_out| Box::new(Traces { diagnosis, figures, held_out });
    let orders = |held_out| Box::new(Orders { diagnosis, figures, held_out });
    let page = Page {
        kind: "Diagnosis",
        heading: diagnosis.summary.clone(),
        badge: Some(badge(diagnosis.verdict)),
        sections: vec![
            Box::new(Answer { diagnosis }),
            Box::new(Place { diagnosis, figures }),
            traces(false),
            orders(false),
            Box::new(Ranking { diagnosis }),
            Box::new(Effects { diagnosis }),
            Box::new(Parameters { diagnosis }),
            Box::new(Errors { diagnosis }),
            traces(true),
            orders(true),
            Box::new(Next { diagnosis, figures }),
            Box::new(Checks { diagnosis }),
        ],
    };
    page.render()
}

fn badge(verdict: Verdict) -> Badge {
    let (text, tone) = match verdict {
        Verdict::Named => ("named", Tone::Good),
        Verdict::NoMismatch => ("no mismatch", Tone::Good),
        Verdict::Ambiguous => ("ambiguous", Tone::Unsure),
        Verdict::NotExcited => ("not excited", Tone::Unsure),
        Verdict::Unexplained => ("unexplained", Tone::Bad),
    };
    Badge { text: text.into(), tone }
}

//! A twin and the recordings it is held to, of whichever domain its model is.

use std::path::{Path, PathBuf};

use crate::io::{InputError, TwinFile, hint_among};
use crate::market::{LogReader, check_needs, execution_assembly};
use crate::robot::{
    cart_pole_assembly, cart_pole_recordings, equations_assembly, equations_recordings, joint_assembly, joint_recordings,
    tanks_assembly, tanks_recordings, unread_columns,
};
use crate::sim2real::diagnose::{Calibration, Unread, Verdict, calibrate, diagnose_beside};
use crate::sim2real::{Assembly, Parameter, Plant, Recording, Seed, Simulator};

use super::diagnosed::Diagnosed;
use super::fitted::FittedTwin;
use super::pace;
use super::screen::Progress;

/// The models a twin can name.
const MODELS: [&str; 5] = ["joint", "cart_pole", "tanks", "equations", "execution"];

/// A twin with its recordings, whatever they are of.
pub(super) struct Case {
    trial: Box<dyn Trial>,
    /// The same with a controller that acts once a row, where the twin has one and does not say how often it acts.
    once_a_row: Option<Box<dyn Trial>>,
}

/// What can be done with a twin and its recordings.
trait Trial {
    /// The same, in which the mechanisms of these ids are not known.
    fn without(self: Box<Self>, ids: &[String]) -> Result<Box<dyn Trial>, InputError>;
    fn diagnose(&self, seed: Seed, progress: &Progress) -> Diagnosed;
    fn calibrate(&self, seed: Seed, progress: &Progress) -> (Calibration, FittedTwin);
    fn parameters(&self) -> &[Parameter];
    /// The usual time between two rows of the first recording [s].
    fn spacing(&self) -> Option<f64>;
}

struct Given<P: Plant> {
    file: TwinFile,
    twin: Assembly<P>,
    recordings: Vec<Recording<P::Stimulus>>,
    held_out: Vec<Recording<P::Stimulus>>,
    /// What recordings have that the twin does not read. Of orders and fills every column has a meaning of its own.
    unread: Vec<Unread>,
}

impl Case {
    /// Reads the recordings at `recordings` and `held_out` as `twin` says.
    ///
    /// # Errors
    /// A model there is not, a recording that is fitted and held out, and what the domain's readers refuse.
    pub fn read(twin: &TwinFile, recordings: &[PathBuf], held_out: &[PathBuf]) -> Result<Self, InputError> {
        check_apart(recordings, held_out)?;
        let trial = trial(twin, recordings, held_out)?;
        let paced = trial.spacing().and_then(|spacing| pace::once_a_row(twin, spacing));
        let once_a_row = paced.map(|twin| self::trial(&twin, recordings, held_out)).transpose()?;
        Ok(Self { trial, once_a_row })
    }

    /// The same case, in which the mechanisms of these ids are not known.
    ///
    /// # Errors
    /// An id the registry of the twin's plant does not have either.
    pub fn without(self, ids: &[String]) -> Result<Self, InputError> {
        let once_a_row = self.once_a_row.map(|trial| trial.without(ids)).transpose()?;
        Ok(Self { trial: self.trial.without(ids)?, once_a_row })
    }

    /// Finds what the twin leaves out. How often its controller acts, where it does not say that, is what explains the recordings
    /// better: at every step, or once a row.
    pub fn diagnose(&self, seed: Seed, progress: &Progress) -> Diagnosed {
        let at_every_step = self.trial.diagnose(seed, progress);
        match &self.once_a_row {
            Some(trial) if at_every_step.diagnosis.verdict != Verdict::NoMismatch => {
                pace::better(at_every_step, trial.diagnose(seed, progress))
            }
            _ => at_every_step,
        }
    }

    /// Refits the parameters the twin has; gives the twin they make.
    pub fn calibrate(&self, seed: Seed, progress: &Progress) -> (Calibration, FittedTwin) {
        self.trial.calibrate(seed, progress)
    }

    /// Whether the twin has a parameter that a fit may move.
    pub fn has_free_parameters(&self) -> bool {
        self.trial.parameters().iter().any(|parameter| !parameter.frozen())
    }
}

impl<P: Plant> Trial for Given<P> {
    fn without(self: Box<Self>, ids: &[String]) -> Result<Box<dyn Trial>, InputError> {
        let known: Vec<&str> = self.twin.registry().iter().map(|mechanism| mechanism.about().name).collect();
        if let Some(unknown) = ids.iter().find(|id| !known.contains(&id.as_str())) {
            let error = InputError::new("--without", format!("there is no mechanism `{unknown}`"));
            return Err(error.maybe_hint(hint_among(unknown, &known)));
        }
        Ok(Box::new(Self { twin: self.twin.excluding(ids), ..*self }))
    }

    fn diagnose(&self, seed: Seed, progress: &Progress) -> Diagnosed {
        let tell = |step: &str, done: usize, of: usize| progress.tell(step, done, of);
        let outcome = diagnose_beside(&self.twin, &self.recordings, &self.held_out, &self.unread, seed, &tell);
        Diagnosed {
            file: self.file.clone(),
            trued: FittedTwin::of(&outcome.trued, &outcome.values, &outcome.std, &outcome.correlation),
            diagnosis: outcome.diagnosis,
            comparisons: outcome.comparisons,
            profiles: outcome.profiles,
            excitation: outcome.excitation,
        }
    }

    fn calibrate(&self, seed: Seed, progress: &Progress) -> (Calibration, FittedTwin) {
        let tell = |step: &str, done: usize, of: usize| progress.tell(step, done, of);
        let calibration = calibrate(&self.twin, &self.recordings, &self.held_out, seed, &tell);
        let twin = FittedTwin::of(&self.twin, &calibration.values, &calibration.std, &calibration.correlation);
        (calibration, twin)
    }

    fn parameters(&self) -> &[Parameter] {
        self.twin.parameters()
    }

    fn spacing(&self) -> Option<f64> {
        let time = &self.recordings.first()?.time;
        let mut spacings: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        spacings.sort_by(f64::total_cmp);
        // Times are told to so many digits, and their differences to fewer.
        format!("{:.6e}", spacings.get(spacings.len() / 2)?).parse().ok()
    }
}

/// Reads the recordings at `recordings` and `held_out` as `twin` says.
fn trial(twin: &TwinFile, recordings: &[PathBuf], held_out: &[PathBuf]) -> Result<Box<dyn Trial>, InputError> {
    let file = twin.clone();
    let unread = if twin.model == "execution" { Vec::new() } else { unread_columns(twin, recordings) };
    Ok(match twin.model.as_str() {
        "joint" => Box::new(Given {
            file,
            twin: joint_assembly(twin)?,
            recordings: joint_recordings(twin, recordings)?,
            held_out: joint_recordings(twin, held_out)?,
            unread,
        }),
        "cart_pole" => Box::new(Given {
            file,
            twin: cart_pole_assembly(twin)?,
            recordings: cart_pole_recordings(twin, recordings)?,
            held_out: cart_pole_recordings(twin, held_out)?,
            unread,
        }),
        "tanks" => {
            let recordings = tanks_recordings(twin, recordings)?;
            let assembly = tanks_assembly(twin, &recordings)?;
            Box::new(Given { file, twin: assembly, recordings, held_out: tanks_recordings(twin, held_out)?, unread })
        }
        "equations" => {
            let recordings = equations_recordings(twin, recordings)?;
            let assembly = equations_assembly(twin, &recordings)?;
            Box::new(Given { file, twin: assembly, recordings, held_out: equations_recordings(twin, held_out)?, unread })
        }
        "execution" => {
            let assembly = execution_assembly(twin)?;
            // By one reader, so that the tape is read once.
            let mut reader = LogReader::of(twin)?;
            let (recordings, held_out) = (reader.read_all(recordings)?, reader.read_all(held_out)?);
            check_needs(twin, &recordings)?;
            check_needs(twin, &held_out)?;
            Box::new(Given { file, twin: assembly, recordings, held_out, unread })
        }
        other => {
            let error = twin.error(&["twin", "model"], format!("there is no model `{other}`"));
            return Err(error.maybe_hint(hint_among(other, &MODELS)));
        }
    })
}

/// Holds what is to be held out not to be fitted too: the proof would be none.
fn check_apart(recordings: &[PathBuf], held_out: &[PathBuf]) -> Result<(), InputError> {
    let hint = "name another under --holdout, or none: then the last 30 % of each recording is held out";
    let pairs = held_out.iter().flat_map(|path| recordings.iter().map(move |own| (path, own)));
    for (path, own) in pairs {
        if real(path) == real(own) {
            return Err(InputError::new(path, "the recording is fitted and held out at once").hint(hint));
        }
        if is_copy(path, own) {
            let what = format!("the recording is {} again, byte for byte, which is fitted", own.display());
            return Err(InputError::new(path, what).hint(hint));
        }
    }
    Ok(())
}

/// The file itself, whatever way leads to it.
fn real(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}

/// Whether two files hold the same bytes. What cannot be read is told where it is needed.
fn is_copy(path: &Path, other: &Path) -> bool {
    let size = |path: &Path| std::fs::metadata(path).ok().filter(|known| known.is_file()).map(|known| known.len());
    let as_long = size(path).is_some_and(|own| own > 0 && size(other) == Some(own));
    as_long && matches!((std::fs::read(path), std::fs::read(other)), (Ok(own), Ok(other)) if own == other)
}

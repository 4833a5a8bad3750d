//! Networks in files.

use super::fit::FitOptions;
use super::history::History;
use super::network::{Description, Network};
use super::optimizer::Optimizer;
use crate::error::{Error, Result};
use crate::io;
use burn::module::Module;
use burn::record::{BinBytesRecorder, FullPrecisionSettings, Record, Recorder};
use burn::tensor::backend::{AutodiffBackend, Backend};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Writes a network with its description.
///
/// # Errors
/// [`Error::File`] for a file that cannot be written.
pub fn save<B: Backend>(path: &Path, network: &Network<B>, description: &Description) -> Result<()> {
    write::<B, _>(path, (text(path, description)?, network.clone().into_record()))
}

/// Reads what [`save`] wrote, on any backend.
///
/// # Errors
/// [`Error::File`] for a file that is missing or was written otherwise.
pub fn load<B: Backend>(path: &Path, device: &B::Device) -> Result<(Network<B>, Description)> {
    // The description comes first; the network's own record cannot be told before it is known.
    let (described, record): (String, <Network<B> as Module<B>>::Record) = read::<B, _>(path, device)?;
    let description: Description = parse(path, &described)?;
    Ok((Network::new(&description, 0, device).load_record(record), description))
}

/// Where a training stands, beside its numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Progress {
    pub(super) options: FitOptions,
    pub(super) description: Description,
    pub(super) history: History,
}

/// Writes all that is needed to go on as if nothing had happened.
pub(super) fn save_training<B: AutodiffBackend>(
    path: &Path,
    progress: &Progress,
    network: &Network<B>,
    optimizer: &Optimizer<B>,
) -> Result<()> {
    let (weights, others) = optimizer.records();
    write::<B, _>(path, (text(path, progress)?, network.clone().into_record(), weights, others))
}

/// Reads what [`save_training`] wrote.
pub(super) fn load_training<B: AutodiffBackend>(
    path: &Path,
    device: &B::Device,
) -> Result<(Progress, Network<B>, Optimizer<B>)> {
    let (told, record, weights, others): (String, <Network<B> as Module<B>>::Record, _, _) =
        read::<B, _>(path, device)?;
    let progress: Progress = parse(path, &told)?;
    let network = Network::new(&progress.description, 0, device).load_record(record);
    let mut optimizer = Optimizer::new(progress.options.schedule, &network);
    optimizer.load((weights, others));
    Ok((progress, network, optimizer))
}

fn write<B: Backend, R: Record<B>>(path: &Path, record: R) -> Result<()> {
    let recorder = BinBytesRecorder::<FullPrecisionSettings>::default();
    let bytes = Recorder::<B>::record(&recorder, record, ()).map_err(|e| Error::file(path, e))?;
    io::write_through(path, |out| out.write_all(&bytes))
}

fn read<B: Backend, R: Record<B>>(path: &Path, device: &B::Device) -> Result<R> {
    let bytes = std::fs::read(path).map_err(|e| Error::file(path, e))?;
    let recorder = BinBytesRecorder::<FullPrecisionSettings>::default();
    Recorder::<B>::load(&recorder, bytes, device)
        .map_err(|e| Error::file(path, format!("not a network of this program: {e}")))
}

fn text<T: Serialize>(path: &Path, value: &T) -> Result<String> {
    serde_json::to_string(value).map_err(|e| Error::file(path, e))
}

fn parse<T: serde::de::DeserializeOwned>(path: &Path, text: &str) -> Result<T> {
    serde_json::from_str(text).map_err(|e| Error::file(path, format!("not a network of this program: {e}")))
}

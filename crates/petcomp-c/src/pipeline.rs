//! Open recipes.
#![expect(unsafe_code, reason = "called from C")]

use crate::handles::Handles;
use crate::memory::{put, text, texts};
use crate::status::{Failure, Status, call};
use bytemuck::{Pod, Zeroable};
use petcomp::Result;
use petcomp::dataset::{DatasetConfig, Pipeline};
use petcomp::io::Override;
use std::ffi::c_char;
use std::sync::Arc;

/// An open recipe with its assets and photos. 0 is no pipeline.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct PipelineHandle {
    /// Never reused.
    pub id: u64,
}

/// A pipeline, and the classes of its labels.
pub(crate) struct OpenedPipeline {
    pub(crate) pipeline: Pipeline,
    pub(crate) classes: Vec<String>,
}

static PIPELINES: Handles<OpenedPipeline> = Handles::new("pipeline");

pub(crate) fn opened(
    pipeline: PipelineHandle,
) -> std::result::Result<Arc<OpenedPipeline>, Failure> {
    PIPELINES.get(pipeline.id)
}

/// Opens a recipe file and the assets and photos that it names.
///
/// * `overrides`: `override_count` strings that change values of the recipe, e.g.
///   `scene.objects=[5,15]`; may be null if there are none
/// * `pipeline`: receives the handle; close it with petcomp_pipeline_close()
///
/// # Safety
/// Each pointer is null or points to memory as described; strings end with a NUL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn petcomp_pipeline_open(
    recipe: *const c_char,
    overrides: *const *const c_char,
    override_count: usize,
    pipeline: *mut PipelineHandle,
) -> Status {
    call(|| {
        // SAFETY: promised by the caller.
        let (recipe, overrides) = unsafe {
            // Whether the handle can be told, before there is one.
            put("pipeline", PipelineHandle::zeroed(), pipeline)?;
            let overrides = texts("overrides", overrides, override_count)?;
            (text("recipe", recipe)?, overrides)
        };
        let id = PIPELINES.open(open(recipe, &overrides)?);
        // SAFETY: promised by the caller.
        unsafe { put("pipeline", PipelineHandle { id }, pipeline) }
    })
}

fn open(recipe: &str, overrides: &[&str]) -> Result<OpenedPipeline> {
    let overrides: Result<Vec<Override>> = overrides.iter().map(|o| o.parse()).collect();
    let pipeline = Pipeline::open(DatasetConfig::read(recipe, &overrides?)?)?;
    let obstructed = pipeline.config().labels.obstructed;
    Ok(OpenedPipeline {
        classes: obstructed.classes(&pipeline.library().classes)?,
        pipeline,
    })
}

/// Closes a pipeline. Its samples remain valid.
#[unsafe(no_mangle)]
pub extern "C" fn petcomp_pipeline_close(pipeline: PipelineHandle) -> Status {
    call(|| PIPELINES.close(pipeline.id))
}

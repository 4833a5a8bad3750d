//! A picture and its labels.

use crate::arrays::{Given, GivenMatte, to_array};
use crate::document::text;
use crate::errors::{internal, to_python, wrong_value};
use crate::lock::locked;
use crate::picture::check_sound;
use crate::work;
use numpy::ndarray::Array2;
use numpy::{PyArray2, PyArrayDyn};
use petcomp::dataset::{self, Extent, LabelledObject, Obstructed, Pictures, Provenance};
use petcomp::label::{Labels, ObjectLabel, RleMask};
use petcomp::{DeepImage, Image, ImageView, ObjectId, PremulRgba, Srgb8, composite};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use std::sync::{Arc, Mutex};

/// How a sample's labels are read.
#[derive(Clone)]
pub(crate) struct Policy {
    pub(crate) classes: Vec<String>,
    pub(crate) obstructed: Obstructed,
    pub(crate) extent: Extent,
}

impl Policy {
    /// Names of the objects' own classes: all but the one that is added for obstructed objects.
    fn object_classes(&self) -> &[String] {
        let added = usize::from(self.obstructed == Obstructed::Class);
        &self.classes[..self.classes.len() - added]
    }
}

/// The file that a dataset has of a sample; by default one without loss, as of a picture without number.
#[derive(Default)]
pub(crate) struct PictureFile {
    pub(crate) pictures: Pictures,
    pub(crate) seed: u64,
    pub(crate) k: u64,
}

impl PictureFile {
    /// What whoever reads it sees.
    fn shown(&self, frame: &Image<PremulRgba>) -> petcomp::Result<Image<Srgb8>> {
        self.pictures.shown(frame, self.seed, self.k)
    }
}

/// An image and its labels.
#[pyclass(frozen, module = "petcomp._petcomp")]
pub(crate) struct Sample {
    facts: Arc<Facts>,
    frame: Mutex<Frame>,
}

/// All but the picture.
struct Facts {
    size: [usize; 2],
    deep: DeepImage,
    labels: Labels,
    provenance: Option<Provenance>,
    policy: Policy,
    file: PictureFile,
}

/// The picture, until it is moved into an array, and what is made from it.
struct Frame {
    linear: Option<Arc<Image<PremulRgba>>>,
    array: Option<Py<PyArrayDyn<f32>>>,
    shown: Option<Py<PyArrayDyn<u8>>>,
}

impl Sample {
    pub(crate) fn new(sample: dataset::Sample, policy: Policy) -> Self {
        Self::of_file(sample, policy, PictureFile::default())
    }

    pub(crate) fn of_file(sample: dataset::Sample, policy: Policy, file: PictureFile) -> Self {
        let (width, height) = sample.frame.size();
        Self {
            facts: Arc::new(Facts {
                size: [width, height],
                deep: sample.deep,
                labels: sample.labels,
                provenance: sample.provenance,
                policy,
                file,
            }),
            frame: Mutex::new(Frame {
                linear: Some(Arc::new(sample.frame)),
                array: None,
                shown: None,
            }),
        }
    }

    pub(crate) fn policy(&self) -> &Policy {
        &self.facts.policy
    }

    /// Whether its labels were made by a policy that somebody chose, not from masks.
    pub(crate) fn has_policy(&self) -> bool {
        self.facts.provenance.is_some() || self.facts.deep.width() > 0
    }

    /// Whether these begin with its objects' classes: then its numbers mean the same.
    pub(crate) fn is_of(&self, classes: &[String]) -> bool {
        classes.starts_with(self.policy().object_classes())
    }

    /// What the library's writers take.
    pub(crate) fn to_dataset_sample(&self, py: Python<'_>) -> PyResult<dataset::Sample> {
        let linear = locked(&self.frame).linear.clone();
        let frame = match linear {
            Some(linear) => py.detach(|| Image::clone(&linear)),
            None => self.changed_frame(py)?,
        };
        let facts = &self.facts;
        Ok(py.detach(|| dataset::Sample {
            deep: facts.deep.clone(),
            provenance: facts.provenance.clone(),
            ..dataset::Sample::new(frame, facts.labels.clone())
        }))
    }

    /// The picture in its array, as whoever has that may have changed it.
    fn changed_frame(&self, py: Python<'_>) -> PyResult<Image<PremulRgba>> {
        let array = locked(&self.frame)
            .array
            .as_ref()
            .map(|array| array.bind(py).clone().into_any());
        let array = array.ok_or_else(|| internal("a sample without a picture"))?;
        let pixels = Given::from_argument("image_linear", &array)?;
        let checked = py.detach(|| {
            let pixels = pixels.decoded("image_linear")?.into_premul();
            check_sound("image_linear", &pixels)?;
            Ok(pixels)
        });
        checked.map_err(to_python)
    }
}

impl Facts {
    fn labelled(&self) -> Vec<LabelledObject<'_>> {
        let count = self.policy.classes.len();
        let Policy {
            obstructed, extent, ..
        } = &self.policy;
        obstructed.labelled(&self.labels, count, &[*extent])
    }

    fn mask(&self, place: usize) -> PyResult<&RleMask> {
        let labelled = self.labelled();
        let label = labelled.get(place).ok_or_else(|| {
            PyIndexError::new_err(format!(
                "mask {place}, expected less than {}",
                labelled.len()
            ))
        })?;
        Ok(self.policy.extent.of(label.object).1)
    }

    /// Of the objects in front; infinite where there is none.
    fn depths(&self) -> Image<f32> {
        let [width, height] = self.size;
        Image::from_fn(width, height, |x, y| {
            let front = composite::front(self.samples(x, y));
            front.map_or(f32::INFINITY, |sample| sample.depth.0)
        })
    }

    fn ids(&self) -> Image<u32> {
        let [width, height] = self.size;
        if self.deep.width() == 0 {
            return self.ids_of_masks();
        }
        Image::from_fn(width, height, |x, y| {
            composite::front(self.samples(x, y)).map_or(0, |sample| sample.object.0)
        })
    }

    /// Of a picture that was made in another way: nothing but their order tells which is in front.
    fn ids_of_masks(&self) -> Image<u32> {
        front_ids(&self.labels.objects, self.size)
    }

    /// None for a picture that was made in another way.
    fn samples(&self, x: usize, y: usize) -> &[petcomp::DeepSample] {
        if self.deep.width() == 0 {
            return &[];
        }
        self.deep.at(x, y)
    }
}

#[pymethods]
impl Sample {
    /// Creates a sample from any image and the masks of its objects.
    #[staticmethod]
    fn from_masks(
        py: Python<'_>,
        image: &Bound<'_, PyAny>,
        masks: Vec<Bound<'_, PyAny>>,
        object_classes: Vec<u32>,
        classes: Vec<String>,
    ) -> PyResult<Self> {
        let image = Given::from_argument("image", image)?;
        let masks: PyResult<Vec<_>> = masks
            .iter()
            .map(|mask| GivenMatte::from_argument("masks", mask))
            .collect();
        let masks = masks?;
        check_classes(&object_classes, masks.len(), classes.len())?;
        let policy = Policy {
            classes,
            obstructed: Obstructed::Keep,
            extent: Extent::Amodal,
        };
        let sample = work::run(py, move || {
            let frame = image.decoded("image")?.into_premul();
            check_sound("image", &frame)?;
            let labels = labels_of(frame.size(), &masks, &object_classes)?;
            Ok(dataset::Sample::new(frame, labels))
        })?;
        Ok(Self::new(sample, policy))
    }

    #[getter]
    fn size(&self) -> [usize; 2] {
        self.facts.size
    }

    /// height x width x 3, uint8, sRGB.
    fn image(&self, py: Python<'_>) -> PyResult<Py<PyArrayDyn<u8>>> {
        let linear = {
            let frame = locked(&self.frame);
            if let Some(shown) = &frame.shown {
                return Ok(shown.clone_ref(py));
            }
            frame.linear.clone()
        };
        let linear = linear.ok_or_else(|| internal("a sample without a picture"))?;
        let facts = self.facts.clone();
        let shown = work::run(py, move || facts.file.shown(&linear))?;
        let array = to_array::<Srgb8, u8>(py, shown)?.unbind();
        let mut frame = locked(&self.frame);
        Ok(frame.shown.get_or_insert(array).clone_ref(py))
    }

    /// height x width x 4, float32, scene-linear, premultiplied.
    fn image_linear(&self, py: Python<'_>) -> PyResult<Py<PyArrayDyn<f32>>> {
        // What is shown is made first: the array is the caller's to change.
        self.image(py)?;
        let mut frame = locked(&self.frame);
        if let Some(linear) = frame.linear.take() {
            let linear = Arc::try_unwrap(linear).unwrap_or_else(|shared| Image::clone(&shared));
            frame.array = Some(to_array::<PremulRgba, f32>(py, linear)?.unbind());
        }
        let array = frame.array.as_ref().map(|array| array.clone_ref(py));
        array.ok_or_else(|| internal("a sample without a picture"))
    }

    fn depth<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let facts = self.facts.clone();
        to_array(py, work::run(py, move || Ok(facts.depths()))?)
    }

    fn ids<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<u32>>> {
        let facts = self.facts.clone();
        to_array(py, work::run(py, move || Ok(facts.ids()))?)
    }

    /// One row per object: x0, y0, x1, y1.
    fn boxes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let labelled = self.facts.labelled();
        let boxes = labelled
            .iter()
            .map(|label| self.facts.policy.extent.of(label.object).0);
        let numbers: Vec<f64> = boxes.flat_map(|b| [b.x0, b.y0, b.x1, b.y1]).collect();
        let array = Array2::from_shape_vec((labelled.len(), 4), numbers);
        Ok(PyArray2::from_owned_array(
            py,
            array.map_err(|e| internal(&e.to_string()))?,
        ))
    }

    /// Id, class and ignore flag of each labelled object.
    fn labelled(&self) -> Vec<(u32, u32, bool)> {
        let labelled = self.facts.labelled();
        labelled
            .iter()
            .map(|label| (label.object.id.0, label.class, label.ignored))
            .collect()
    }

    fn class_names(&self) -> Vec<String> {
        self.facts.policy.classes.clone()
    }

    /// COCO's compressed RLE of a labelled object, as JSON.
    fn mask_json(&self, place: usize) -> PyResult<String> {
        text(self.facts.mask(place)?).map_err(to_python)
    }

    /// height x width, bool.
    fn mask<'py>(&self, py: Python<'py>, place: usize) -> PyResult<Bound<'py, PyArray2<bool>>> {
        let [width, height] = self.facts.size;
        let mut inside = Array2::from_elem((height, width), false);
        for (x, y) in self.facts.mask(place)?.pixels() {
            inside[(y as usize, x as usize)] = true;
        }
        Ok(PyArray2::from_owned_array(py, inside))
    }

    fn labels_json(&self) -> PyResult<String> {
        text(&self.facts.labels).map_err(to_python)
    }

    fn scene_json(&self) -> PyResult<Option<String>> {
        let scene = self.facts.provenance.as_ref().map(|p| text(&p.scene));
        scene.transpose().map_err(to_python)
    }

    /// Every drawn value by its path.
    fn draws(&self) -> Vec<(String, f64)> {
        let draws = self.facts.provenance.iter().flat_map(|p| &p.draws);
        draws.map(|draw| (draw.path.clone(), draw.value)).collect()
    }
}

fn check_classes(object_classes: &[u32], masks: usize, classes: usize) -> PyResult<()> {
    if object_classes.len() != masks {
        let count = object_classes.len();
        return Err(wrong_value(
            "object_classes",
            format_args!("{count}, expected one for each of {masks} masks"),
        ));
    }
    match object_classes
        .iter()
        .find(|class| **class as usize >= classes)
    {
        None => Ok(()),
        Some(class) => Err(wrong_value(
            "object_classes",
            format_args!("{class}, but there are {classes} classes"),
        )),
    }
}

fn labels_of(
    (width, height): (usize, usize),
    masks: &[GivenMatte],
    classes: &[u32],
) -> petcomp::Result<Labels> {
    let objects = (1..).zip(masks).zip(classes);
    let objects: petcomp::Result<Vec<_>> = objects
        .map(|((id, mask), class)| {
            if mask.size() != (width, height) {
                let (w, h) = mask.size();
                let what = format!("{w} x {h}, but the picture has {width} x {height}");
                return Err(petcomp::Error::value(format!("masks[{}]", id - 1), what));
            }
            Ok(object_of(id, mask, *class))
        })
        .collect();
    let mut objects = objects?;
    hide_behind_later(&mut objects, [width, height]);
    Ok(Labels {
        image: [width as u32, height as u32],
        objects,
        ..Labels::default()
    })
}

/// Leaves of each object what none after it covers, and notes which of those cover it.
fn hide_behind_later(mut objects: &mut [ObjectLabel], size: [usize; 2]) {
    let front = front_ids(objects, size);
    while let [object, later @ ..] = objects {
        let mask = runs_of(front.view(), |id| id == object.id.0);
        let whole = object.amodal_mask.area().max(1);
        object.visible_fraction = mask.area() as f64 / whole as f64;
        object.visible_box = mask.bounds();
        object.visible_mask = mask;
        let over = later
            .iter()
            .filter(|other| other.amodal_mask.overlaps(&object.amodal_mask));
        object.covered_by = over.map(|other| other.id).collect();
        objects = later;
    }
}

/// Which of some objects, each in front of those before it, each pixel shows; 0 for none.
fn front_ids(objects: &[ObjectLabel], [width, height]: [usize; 2]) -> Image<u32> {
    let mut ids = Image::new(width, height);
    for object in objects {
        for (x, y) in object.amodal_mask.pixels() {
            ids[(x as usize, y as usize)] = object.id.0;
        }
    }
    ids
}

fn object_of(id: u32, mask: &GivenMatte, class: u32) -> ObjectLabel {
    let mask = match mask {
        GivenMatte::Coverage(matte) => runs_of(matte.view(), |share| share.0 > 0.5),
        GivenMatte::Inside(inside) => runs_of(inside.view(), |code| code != 0),
    };
    ObjectLabel {
        id: ObjectId(id),
        class,
        amodal_box: mask.bounds(),
        amodal_mask: mask,
        ..ObjectLabel::default()
    }
}

/// The pixels of an object, read where they are: there may be many masks.
fn runs_of<P: Copy>(pixels: ImageView<'_, P>, is_inside: impl Fn(P) -> bool) -> RleMask {
    let (width, height) = pixels.size();
    RleMask::from_fn([width as u32, height as u32], |x, y| {
        is_inside(pixels.row(y as usize)[x as usize])
    })
}

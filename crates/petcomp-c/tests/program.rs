//! A C program makes what petcomp itself makes, and valgrind has nothing to say of it.

use petcomp::asset;
use petcomp::dataset::{self, DatasetConfig, Pipeline};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::atomic::AtomicBool;

const SEED: &str = "5";
const K: &str = "1";
/// Exit status of valgrind where it has found something.
const FOUND: &str = "99";

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The library was built for this test, beside it.
fn built_library() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    test.with_file_name("libpetcomp_c.so")
}

/// The library under the names that it is installed with.
fn install(folder: &Path) {
    for name in ["libpetcomp.so", "libpetcomp.so.0"] {
        std::os::unix::fs::symlink(built_library(), folder.join(name)).unwrap();
    }
}

/// A recipe for small pictures of two bottles, with more lines behind those of its labels.
fn write_recipe(folder: &Path, more: &str) -> PathBuf {
    let samples = repository().canonicalize().unwrap().join("tests/samples");
    let mut list = String::from("file,asset,class,length\n");
    for name in ["b0000_0", "b0001_0"] {
        let photo = samples.join("bottles").join(name).with_extension("png");
        list += &format!("{},{name},bottle,0.25\n", photo.display());
    }
    std::fs::write(folder.join("photos.csv"), list).unwrap();
    let (list, assets) = (folder.join("photos.csv"), folder.join("assets"));
    asset::build(list, assets, &|_, _| {}, &AtomicBool::new(false)).unwrap();
    let backgrounds = write_backgrounds(folder, &samples);
    let recipe = format!(
        "assets = \"assets\"\nbackgrounds = {:?}\n[scene]\nimage = [160, 120]\nobjects = [2, 3]\n\
         [labels]\nobstructed = \"keep\"\n{more}[render]\nsubsamples = 1\nambient_samples = 8\n",
        backgrounds
    );
    std::fs::write(folder.join("recipe.toml"), recipe).unwrap();
    folder.join("recipe.toml")
}

/// One photo with its label, and one without.
fn write_backgrounds(folder: &Path, samples: &Path) -> PathBuf {
    let backgrounds = folder.join("backgrounds");
    std::fs::create_dir(&backgrounds).unwrap();
    for name in ["bg0000.jpg", "bg0000.label.json", "bg0001.jpg"] {
        std::fs::copy(
            samples.join("backgrounds").join(name),
            backgrounds.join(name),
        )
        .unwrap();
    }
    backgrounds
}

/// As somebody types it.
fn generate(recipe: &Path, folder: &Path) {
    let pipeline = Pipeline::open(DatasetConfig::read(recipe, &[]).unwrap()).unwrap();
    let seed = SEED.parse().unwrap();
    let plan = pipeline.plan(2, seed, folder).unwrap();
    let sample = |k| pipeline.sample(seed, k);
    dataset::generate(&plan, sample, &|_| {}, &AtomicBool::new(false)).unwrap();
}

/// Every warning is an error.
fn compile(folder: &Path, compiler: &str, source: &Path, arguments: &[&str]) {
    let done = Command::new(compiler)
        .args(["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-g", "-I"])
        .arg(include_folder())
        .arg(source)
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{said}");
}

fn include_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("include")
}

fn run(mut command: Command, folder: &Path, recipe: &Path) -> Output {
    command
        .arg(recipe)
        .args([SEED, K, "picture.ppm", "labels.json"])
        .env("LD_LIBRARY_PATH", folder)
        .current_dir(folder)
        .output()
        .unwrap()
}

/// Under valgrind, where it is installed; optimised code alone is quick enough for it.
fn run_checked(folder: &Path, recipe: &Path) -> Output {
    let mut valgrind = Command::new("valgrind");
    if cfg!(debug_assertions) || valgrind.arg("--version").output().is_err() {
        println!(
            "valgrind is not installed, or this is not a release build: nothing looks at the program's memory"
        );
        return run(Command::new(folder.join("sample")), folder, recipe);
    }
    let mut valgrind = Command::new("valgrind");
    valgrind
        .args([
            "-q",
            "--leak-check=full",
            "--errors-for-leak-kinds=definite",
        ])
        .arg(format!("--error-exitcode={FOUND}"))
        .arg("./sample");
    run(valgrind, folder, recipe)
}

/// A sample by the program in C, and a dataset of the same recipe; returns what the former said, and
/// what it warned of.
fn make_both(folder: &Path, more: &str) -> [String; 2] {
    install(folder);
    let recipe = write_recipe(folder, more);
    generate(&recipe, &folder.join("set"));
    let source = repository().join("examples/c/sample.c");
    let program = ["-std=c11", "-o", "sample", "-L.", "-lpetcomp"];
    compile(folder, "cc", &source, &program);

    let done = run_checked(folder, &recipe);
    let said = [done.stdout, done.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(done.status.success(), "{said:?}");
    said
}

#[test]
fn c_program_makes_the_programs_sample() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let [out, warned] = make_both(folder, "");
    let version = env!("CARGO_PKG_VERSION");
    assert!(
        out.starts_with(&format!("petcomp {version}\nmatte 0.")),
        "{out}"
    );
    let warning = "1 of 2 photos has no label and is not used (bg0001.jpg)";
    assert!(warned.contains(warning), "{warned}");
    assert_same_picture(folder, "png");
    assert_eq!(own_labels(folder), program_labels(folder, "amodal_mask"));
}

#[test]
fn c_program_makes_the_programs_jpeg_and_labels() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let more = "formats = ['coco']\ncoco = { boxes = 'visible' }\n\
                [pictures]\nformat = 'jpg'\njpeg_quality = [20, 60]\n";
    make_both(folder, more);
    assert_same_picture(folder, "jpg");
    assert_eq!(own_labels(folder), program_labels(folder, "visible_mask"));
}

fn assert_same_picture(folder: &Path, extension: &str) {
    let [own, theirs] = [
        folder.join("picture.ppm"),
        one_of(folder, "images", extension),
    ]
    .map(|path| image::open(path).unwrap().to_rgb8());
    assert!(own == theirs);
}

/// Sample K is in one part or the other.
fn one_of(folder: &Path, kind: &str, extension: &str) -> PathBuf {
    let parts =
        ["train", "val"].map(|part| folder.join(format!("set/{kind}/{part}/00000{K}.{extension}")));
    parts.into_iter().find(|path| path.exists()).unwrap()
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Class, visible share and mask of each labelled object.
fn own_labels(folder: &Path) -> Vec<serde_json::Value> {
    let objects = json(&folder.join("labels.json"))["objects"].clone();
    let objects = objects.as_array().unwrap().iter();
    objects
        .map(|o| serde_json::json!([o["class"], o["visible_fraction"], o["mask"]]))
        .collect()
}

fn program_labels(folder: &Path, mask: &str) -> Vec<serde_json::Value> {
    let record = json(&one_of(folder, "scenes", "json"));
    let objects = record["labels"]["objects"].as_array().unwrap().iter();
    let labels: Vec<_> = objects
        .map(|o| serde_json::json!([o["class"], o["visible_fraction"], o[mask]]))
        .collect();
    assert_eq!(labels.len(), record["labelled"].as_array().unwrap().len());
    assert!(!labels.is_empty());
    labels
}

/// What `make c` installs, of libraries that are built already, below a folder.
fn make_c(prefix: &str, folder: &Path) {
    let done = Command::new("make")
        .args(["-o", "packages", "c", "CARGO=true"])
        .arg(format!(
            "RELEASE={}",
            built_library().parent().unwrap().display()
        ))
        .arg(format!("PREFIX={prefix}"))
        .arg(format!("DESTDIR={}", folder.display()))
        .env_remove("MAKEFLAGS")
        .current_dir(repository())
        .output()
        .unwrap();
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
}

/// What pkg-config says of petcomp, installed below a folder.
fn pkg_config(prefix: &Path, folder: &Path) -> Vec<String> {
    let done = Command::new("pkg-config")
        .args(["--cflags", "--libs", "--static", "petcomp"])
        .env("PKG_CONFIG_LIBDIR", prefix.join("lib/pkgconfig"))
        .env("PKG_CONFIG_SYSROOT_DIR", folder)
        .output()
        .unwrap();
    let said = String::from_utf8(done.stdout).unwrap();
    said.split_whitespace().map(str::to_owned).collect()
}

#[test]
fn a_staged_static_library_links_by_pkg_config() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    make_c("/opt/petcomp", folder);
    let prefix = folder.join("opt/petcomp");
    let about = std::fs::read_to_string(prefix.join("lib/pkgconfig/petcomp.pc")).unwrap();
    assert!(about.starts_with("prefix=/opt/petcomp\n"), "{about}");
    // The linker prefers shared ones.
    std::fs::remove_file(prefix.join("lib/libpetcomp.so")).unwrap();

    let arguments = pkg_config(&prefix, folder);
    let mut arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    arguments.extend(["-o", "sample"]);
    let source = repository().join("examples/c/sample.c");
    compile(folder, "cc", &source, &arguments);
    // It links; without a recipe it does no more than the functions that need none.
    let done = run(
        Command::new(folder.join("sample")),
        folder,
        "none.toml".as_ref(),
    );
    let said = String::from_utf8_lossy(&done.stdout);
    let version = concat!("petcomp ", env!("CARGO_PKG_VERSION"), "\n");
    assert!(said.starts_with(version), "{said}");
}

#[test]
fn the_shared_library_exports_its_own_functions_alone() {
    let done = Command::new("nm")
        .args(["-D", "--defined-only", "--format=just-symbols"])
        .arg(built_library())
        .output()
        .unwrap();
    let exported = String::from_utf8(done.stdout).unwrap();
    assert!(exported.contains("petcomp_version"), "{exported}");
    let other = exported.lines().find(|name| !name.starts_with("petcomp_"));
    assert_eq!(other, None);
}

#[test]
fn header_is_one_of_cpp_too() {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("empty.cpp");
    std::fs::write(&source, "#include <petcomp.h>\n").unwrap();
    compile(
        folder.path(),
        "c++",
        &source,
        &["-std=c++17", "-fsyntax-only"],
    );
}

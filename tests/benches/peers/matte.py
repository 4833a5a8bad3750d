#!/usr/bin/env python3
"""Mattes of film: petcomp, Blender's Keying node, ffmpeg's chromakey + despill and PyMatting on the same photos.

    make peers
    taskset -c 0 target/peers-python/bin/python tests/benches/peers/matte.py [-o FOLDER] [--truth FOLDER]

The photo is synthetic with full ground truth (bottle.py), or comes from a folder with ground truth; times and errors are
means over the photos. Every method gets the same 8-bit photo, converted to linear, and the mean colour of the screen; some
get more:

    petcomp film, mask given    the true coverage of the object
    PyMatting                   a trimap from the truth: opaque, no object, and the rest unknown
    ffmpeg                      its defaults, and the best of 25 pairs of similarity and blend by the truth
    the Keying node             the best of 25 pairs of clip levels (searched by petcomp's keyer, which is bit-exact)

In process: petcomp by library.rs, whose keyer writes into the same images each time; Blender's image -> Keying -> Composite
minus image -> Composite; for ffmpeg, a run that repeats the frame before the filters minus one that does not. ffmpeg's
display values are made linear before compositing over backgrounds. The synthetic photo follows the model that `petcomp
matte film` solves for; --truth takes photos from a renderer.
"""

import itertools
import json
import pathlib
import re
import statistics

import numpy as np

import bottle
import linear
from side_by_side import CORES, INSIDE, ROOT, WHOLE, Comparison, arguments, here, library, library_seconds, pinned, \
    seconds_of, spent, told, version

ERROR = "mean |F + V B - truth| over new backgrounds B, linear light"
BLENDER = ["-b", "-t", len(CORES), "--factory-startup", "--python-use-system-env", "-noaudio", "-P",
           "golden/matte/keying_reference.py", "--"]
REPEATS, FRAMES = 10, 50
SIMILARITIES, BLENDS = (0.02, 0.05, 0.1, 0.15, 0.2), (0.0, 0.05, 0.1, 0.2, 0.4)
# Every stage of the keyer, as all_stages.rs has it.
ALL_STAGES = dict(blur_pre=6, clip_black=0.1, clip_white=0.9, edge_kernel_radius=3, blur_post=4, dilate_distance=3,
                  feather_distance=8)
BLACKS, WHITES = (0.0, 0.1, 0.2, 0.3, 0.5), (0.6, 0.7, 0.8, 0.9, 1.0)


class Files:
    """The photos as files, and the results of the methods."""

    def __init__(self, folder, photos):
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self.photos, self.best_chromakey = folder, list(enumerate(photos)), None
        for i, photo in self.photos:
            linear.write_exr(self.at(i, "photo.exr"), photo.seen)
            linear.write_codes(self.at(i, "photo.png"), np.round(255 * linear.to_srgb(photo.seen)).astype(np.uint8))
            linear.write_codes(self.at(i, "cover.png"), np.round(255 * photo.cover).astype(np.uint8))

    def at(self, i, name):
        return self.folder / f"{i}_{name}"

    def mean(self, action):
        """Mean over the photos of what `action` returns for number and photo."""
        return statistics.fmean(action(i, photo) for i, photo in self.photos)

    def judged(self, read):
        """The errors in the form that a Peer needs, from films that are read after a run."""
        return dict(error=lambda: self.mean(lambda i, photo: bottle.errors(photo, *read(i))["error"]),
                    more=lambda: {"alpha_error": self.mean(lambda i, photo: bottle.errors(photo, *read(i))["alpha_error"])})

    def film(self, name):
        """Errors of a file written by `petcomp matte film`."""
        return self.judged(lambda i: (linear.read_exr(self.at(i, name)), linear.read_exr(self.at(i, name), ["VR", "VG", "VB"])))

    def premultiplied(self, name):
        return self.judged(lambda i: (linear.read_exr(self.at(i, name)), 1 - linear.read_exr(self.at(i, name), "A")))

    def straight(self, name):
        """Errors of a display-encoded file with straight alpha."""
        def read(i):
            codes = linear.read_codes(self.at(i, name))
            return linear.from_srgb(codes[..., :3]) * codes[..., 3:], 1 - codes[..., 3:]
        return self.judged(read)


def screen(photo):
    return ",".join(f"{c:.9g}" for c in photo.screen)


def petcomps(comparison, files, args):
    ours, program = version([args.petcomp, "--version"]), library()

    def add(setting, work, *words, times=REPEATS, **judged):
        task = lambda i, photo: [program, times, work, files.at(i, "photo.exr"), *(word(i, photo) for word in words)]
        comparison.add("petcomp", ours, setting, told(pinned(*task(*files.photos[0]))),
                       lambda: files.mean(lambda i, photo: library_seconds(*task(i, photo))), **judged)

    cover = lambda i, _: files.at(i, "cover.png")
    for i, photo in files.photos:
        film = pinned(args.petcomp, "-q", "matte", "film", files.at(i, "photo.exr"), "-o")
        seconds_of([*film, str(files.at(i, "film.exr"))])
        seconds_of([*film, str(files.at(i, "within.exr")), "--mask", str(cover(i, photo))])
    add("film, default", "cut", **files.film("film.exr"))
    add("film, mask given", "film", cover, **files.film("within.exr"))
    for setting, work, settings, name in (("key", "key", {}, "key.exr"), ("key, all stages", "key_all", ALL_STAGES, "key_all.exr")):
        keyed(files, args, settings, name)
        add(setting, work, lambda _, photo: screen(photo), times=5 * REPEATS, **files.premultiplied(name))


def keyed(files, args, settings, name):
    """Run petcomp's keyer on all photos; return its error."""
    words = [word for key, value in settings.items() for word in ("--set", f"key.{key}={value}")]
    for i, photo in files.photos:
        seconds_of(pinned(args.petcomp, "-q", "matte", "key", files.at(i, "photo.exr"), "--screen", screen(photo), *words,
                          "-o", files.at(i, name)))
    return files.premultiplied(name)["error"]()


def keying_nodes(comparison, files, args):
    levels = [dict(clip_black=black, clip_white=white) for black, white in itertools.product(BLACKS, WHITES)]
    best = min(levels, key=lambda settings: keyed(files, args, settings, "clipped.exr"))
    add_keying_node(comparison, files, args, "defaults", {}, "keying")
    add_keying_node(comparison, files, args, "clip black {clip_black}, white {clip_white} (best of 25)".format(**best), best,
                    "keying_clipped")
    add_keying_node(comparison, files, args, "all stages", ALL_STAGES, "keying_all", beside="key, all stages")


def add_keying_node(comparison, files, args, setting, settings, name, beside="key"):
    listing = files.folder / f"{name}.json"
    command = pinned(args.blender, *BLENDER, listing)
    jobs = []
    for i, photo in files.photos:
        common = dict(input=str(files.at(i, "photo.exr")), prefix=str(files.at(i, "")), repeats=REPEATS)
        jobs.append(dict(common, node="empty", params={}, outputs={}))
        params = dict(settings, key_color=list(photo.screen))
        jobs.append(dict(common, node="keying", params=params, outputs={"Image": name}))
    listing.write_text(json.dumps(jobs))

    def run():
        said = spent(command)[1]
        seconds = list(map(float, re.findall(r"render seconds: ([\d.]+)", said)))
        if len(seconds) != REPEATS * len(jobs):
            raise RuntimeError(said[-300:])
        middle = [statistics.median(seconds[k:k + REPEATS]) for k in range(0, len(seconds), REPEATS)]
        return (sum(middle[1::2]) - sum(middle[::2])) / len(files.photos)

    comparison.add("Blender Keying", version([args.blender, "--version"]), setting, told(command), run, beside=beside,
                   **files.premultiplied(f"{name}.exr"))


def chromakey(args, files, i, photo, similarity, blend, *, frames=0, out=None):
    codes = "0x" + "".join(f"{round(255 * c):02x}" for c in linear.to_srgb(photo.screen))
    loop = f"loop=loop={frames}:size=1," if frames else ""
    hue = "green" if photo.screen[1] > photo.screen[2] else "blue"
    filters = f"{loop}format=yuva444p,chromakey={codes}:{similarity}:{blend},format=rgba,despill={hue}"
    sink = [out] if out else ["-f", "null", "-"]
    return pinned(args.ffmpeg, "-v", "error", "-y", "-threads", len(CORES), "-filter_threads", len(CORES), "-i",
                  files.at(i, "photo.png"), "-vf", filters, "-pix_fmt", "rgba", *sink)


def best_chromakey(args, files):
    """Find the best similarity and blend for these photos, as a user would do by hand."""
    def error(pair):
        for i, photo in files.photos:
            seconds_of(chromakey(args, files, i, photo, *pair, out=files.at(i, "chromakey.png")))
        return files.straight("chromakey.png")["error"]()
    return min(itertools.product(SIMILARITIES, BLENDS), key=error)


def chromakeys(comparison, files, args, whole, beside):
    tells = version([args.ffmpeg, "-version"])
    best = files.best_chromakey = files.best_chromakey or best_chromakey(args, files)
    settings = {"similarity 0.01, blend 0 (its defaults)": (0.01, 0.0),
                "similarity {}, blend {} (best of 25)".format(*best): best}
    for setting, pair in settings.items():
        add_chromakey(comparison, files, args, tells, setting, pair, whole, beside)


def add_chromakey(comparison, files, args, tells, setting, pair, whole, beside):
    name, frames = "chromakey_%s_%s.png" % pair, 0 if whole else FRAMES

    def alone(i, photo):
        return seconds_of(chromakey(args, files, i, photo, *pair, out=files.at(i, name)))

    def repeated(i, photo):
        alone(i, photo)
        many, one = (seconds_of(chromakey(args, files, i, photo, *pair, frames=n)) for n in (frames, 0))
        return (many - one) / frames

    command = chromakey(args, files, *files.photos[0], *pair, frames=frames, out=whole and files.at(0, name))
    comparison.add("ffmpeg chromakey + despill", tells, setting, told(command),
                   lambda: files.mean(alone if whole else repeated), beside=beside, **files.straight(name))


def pymattings(comparison, files):
    import pymatting
    films = {}

    def trimap(photo):
        opaque, nothing = photo.passes.max(axis=-1) <= 0.01, photo.cover == 0
        return np.where(opaque, 1.0, np.where(nothing, 0.0, 0.5))

    def run(alpha_of, name):
        def one(i, photo):
            def solve():
                alpha = alpha_of(photo.seen, trimap(photo))
                return alpha, pymatting.estimate_foreground_ml(photo.seen, alpha)
            seconds, (alpha, front) = here(solve)
            films[name, i] = (alpha[..., None] * front, 1 - alpha[..., None])
            return seconds
        return lambda: files.mean(one)

    for name, alpha_of in (("closed form", pymatting.estimate_alpha_cf), ("KNN", pymatting.estimate_alpha_knn)):
        small = np.s_[::8, ::8]  # what is compiled when first met is compiled before the clock runs
        photo = files.photos[0][1]
        alpha = alpha_of(np.ascontiguousarray(photo.seen[small]), np.ascontiguousarray(trimap(photo)[small]))
        pymatting.estimate_foreground_ml(np.ascontiguousarray(photo.seen[small]), alpha)
        command = f"{alpha_of.__name__}(photo, trimap); estimate_foreground_ml(photo, alpha)"
        comparison.add("PyMatting", pymatting.__version__, f"{name}, trimap of the truth", command, run(alpha_of, name),
                       **files.judged(lambda i, name=name: films[name, i]), beside="film, mask given")


def commands(files, args):
    """Time complete commands, from a PNG to a file with alpha."""
    comparison = Comparison("matte commands", args, WHOLE, described(files), ERROR, "the photo's own F and V")
    ours = version([args.petcomp, "--version"])
    def add(setting, words, judged):
        command = lambda i, photo: pinned(args.petcomp, "-q", "-j", len(CORES), "matte", *words(i, photo))
        comparison.add("petcomp", ours, setting, told(command(*files.photos[0])),
                       lambda: files.mean(lambda i, photo: seconds_of(command(i, photo))), **judged)
    add("film to EXR, default", lambda i, _: ["film", files.at(i, "photo.png"), "-o", files.at(i, "film.exr")], files.film("film.exr"))
    add("key to PNG", lambda i, photo: ["key", files.at(i, "photo.png"), "--screen", screen(photo), "-o", files.at(i, "key.png")],
        files.straight("key.png"))
    with comparison.absent_if_it_fails("ffmpeg chromakey + despill"):
        chromakeys(comparison, files, args, whole=True, beside="key to PNG")
    comparison.finish()


def described(files):
    photo = files.photos[0][1]
    return f"{len(files.photos)} photo(s) of film on a screen, {photo.name}" + (" and others" if len(files.photos) > 1 else "")


def main():
    parser = arguments(__doc__)
    parser.add_argument("--truth", type=pathlib.Path, metavar="FOLDER", help="photos with ground truth instead of the synthetic one")
    parser.add_argument("--most", type=int, default=4, help="number of photos to use from that folder (default: %(default)s)")
    parser.add_argument("--size", type=int, nargs=2, default=[640, 480], metavar=("W", "H"), help="size of the synthetic photo")
    parser.add_argument("--no-pymatting", action="store_true", help="skip PyMatting, which takes minutes for some megapixels")
    parser.add_argument("--blender", default="blender", metavar="PROGRAM")
    parser.add_argument("--ffmpeg", default="ffmpeg", metavar="PROGRAM")
    args = parser.parse_args()
    photos = bottle.known(args.truth, args.most) if args.truth else [bottle.drawn(*args.size)]
    files = Files(args.output / "matte", photos)
    comparison = Comparison("matte", args, INSIDE, described(files), ERROR, "the photo's own F and V")
    petcomps(comparison, files, args)
    with comparison.absent_if_it_fails("Blender Keying"):
        keying_nodes(comparison, files, args)
    with comparison.absent_if_it_fails("ffmpeg chromakey + despill"):
        chromakeys(comparison, files, args, whole=False, beside="key")
    if args.no_pymatting:
        comparison.leave_out("PyMatting", "left out by --no-pymatting")
    else:
        with comparison.absent_if_it_fails("PyMatting"):
            pymattings(comparison, files)
    comparison.finish()
    commands(files, args)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Mattes of film: petcomp, Blender's Keying node, ffmpeg's chromakey + despill and PyMatting on the same photos.

    make peers
    taskset -c 0 target/peers-python/bin/python tests/benches/peers/matte.py [-o FOLDER] [--truth FOLDER]

The photo is drawn with all that is known of it (bottle.py), or comes from a folder with truth; times and errors are means
over the photos. Every method gets the same 8-bit photo, made linear, and the mean colour of the screen; two get more:

    petcomp film, mask given    the true coverage of the object
    PyMatting                   a trimap of the truth: opaque, no object, and the rest unknown
    ffmpeg                      the similarity and blend of 25 that do best against the truth

In process: petcomp by library.rs; Blender renders image -> Keying -> Composite less image -> Composite; ffmpeg repeats the
frame before its filters, less a run that does not. ffmpeg's display values are made linear before they are put over
backgrounds. The drawn photo follows the model that `petcomp matte film` solves for; --truth takes photos of a renderer.
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
REPEATS = 10
SIMILARITIES, BLENDS = (0.02, 0.05, 0.1, 0.15, 0.2), (0.0, 0.05, 0.1, 0.2, 0.4)


class Files:
    """The photos as files, and what the methods made of them."""

    def __init__(self, folder, photos):
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self.photos = folder, list(enumerate(photos))
        for i, photo in self.photos:
            linear.write_exr(self.at(i, "photo.exr"), photo.seen)
            linear.write_codes(self.at(i, "photo.png"), np.round(255 * linear.to_srgb(photo.seen)).astype(np.uint8))
            linear.write_codes(self.at(i, "cover.png"), np.round(255 * photo.cover).astype(np.uint8))

    def at(self, i, name):
        return self.folder / f"{i}_{name}"

    def mean(self, action):
        """Of what an action gives for number and photo."""
        return statistics.fmean(action(i, photo) for i, photo in self.photos)

    def judged(self, read):
        """The errors as a Peer wants them, of films that are read once a run is done."""
        return dict(error=lambda: self.mean(lambda i, photo: bottle.errors(photo, *read(i))["error"]),
                    more=lambda: {"alpha_error": self.mean(lambda i, photo: bottle.errors(photo, *read(i))["alpha_error"])})

    def film(self, name):
        """What `petcomp matte film` wrote."""
        return self.judged(lambda i: (linear.read_exr(self.at(i, name)), linear.read_exr(self.at(i, name), ["VR", "VG", "VB"])))

    def premultiplied(self, name):
        return self.judged(lambda i: (linear.read_exr(self.at(i, name)), 1 - linear.read_exr(self.at(i, name), "A")))

    def straight(self, name):
        """Display-encoded with straight alpha."""
        def read(i):
            codes = linear.read_codes(self.at(i, name))
            return linear.from_srgb(codes[..., :3]) * codes[..., 3:], 1 - codes[..., 3:]
        return self.judged(read)


def screen(photo):
    return ",".join(f"{c:.5f}" for c in photo.screen)


def petcomps(comparison, files, args):
    ours, program = version([args.petcomp, "--version"]), library()

    def add(setting, work, *words, **judged):
        task = lambda i, photo: [work, files.at(i, "photo.exr"), *(word(i, photo) for word in words)]
        comparison.add("petcomp", ours, setting, told(pinned(program, REPEATS, *task(*files.photos[0]))),
                       lambda: files.mean(lambda i, photo: library_seconds(program, REPEATS, *task(i, photo))), **judged)

    cover = lambda i, photo: files.at(i, "cover.png")
    for i, photo in files.photos:
        made = lambda name: ["-o", files.at(i, name)]
        seconds_of(pinned(args.petcomp, "matte", "film", files.at(i, "photo.exr"), *made("film.exr")))
        seconds_of(pinned(args.petcomp, "matte", "film", files.at(i, "photo.exr"), "--mask", cover(i, photo), *made("within.exr")))
        seconds_of(pinned(args.petcomp, "matte", "key", files.at(i, "photo.exr"), "--screen", screen(photo), *made("key.exr")))
    add("film, default", "cut", **files.film("film.exr"))
    add("film, mask given", "film", cover, **files.film("within.exr"))
    add("key", "key", lambda i, photo: screen(photo), **files.premultiplied("key.exr"))


def keying_node(comparison, files, args):
    listing, command = files.folder / "keying.json", pinned(args.blender, *BLENDER)
    jobs = []
    for i, photo in files.photos:
        common = dict(input=str(files.at(i, "photo.exr")), prefix=str(files.at(i, "")), repeats=REPEATS)
        jobs.append(dict(common, node="empty", params={}, outputs={}))
        jobs.append(dict(common, node="keying", params=dict(key_color=list(photo.screen)), outputs={"Image": "keying"}))
    listing.write_text(json.dumps(jobs))

    def run():
        said = spent([*command, str(listing)])[1]
        seconds = list(map(float, re.findall(r"render seconds: ([\d.]+)", said)))
        if len(seconds) != REPEATS * len(jobs):
            raise RuntimeError(said[-300:])
        middle = [statistics.median(seconds[k:k + REPEATS]) for k in range(0, len(seconds), REPEATS)]
        return sum(middle[1::2]) - sum(middle[::2])

    comparison.add("Blender Keying", version([args.blender, "--version"]), "defaults", told([*command, str(listing)]),
                   lambda: run() / len(files.photos), beside="key", **files.premultiplied("keying.exr"))


def chromakey(args, files, i, photo, similarity, blend, *, frames=0, out=None):
    codes = "0x" + "".join(f"{round(255 * c):02x}" for c in linear.to_srgb(photo.screen))
    loop = f"loop=loop={frames}:size=1," if frames else ""
    filters = f"{loop}format=yuva444p,chromakey={codes}:{similarity}:{blend},format=rgba,despill=green"
    sink = [out] if out else ["-f", "null", "-"]
    return pinned(args.ffmpeg, "-v", "error", "-y", "-threads", len(CORES), "-filter_threads", len(CORES), "-i",
                  files.at(i, "photo.png"), "-vf", filters, "-pix_fmt", "rgba", *sink)


def best_chromakey(args, files):
    """Similarity and blend that suit these photos best: a person would look for them too."""
    def error(pair):
        for i, photo in files.photos:
            seconds_of(chromakey(args, files, i, photo, *pair, out=files.at(i, "chromakey.png")))
        return files.straight("chromakey.png")["error"]()
    return min(itertools.product(SIMILARITIES, BLENDS), key=error)


def chromakeys(comparison, files, args, whole):
    tells = version([args.ffmpeg, "-version"])
    settings = {"similarity 0.01, blend 0 (its defaults)": (0.01, 0.0)}
    best = best_chromakey(args, files)
    settings["similarity {}, blend {} (best of 25)".format(*best)] = best
    for name, pair in settings.items():
        out = "chromakey_%s_%s.png" % pair
        def one(i, photo, pair=pair, out=out):
            return seconds_of(chromakey(args, files, i, photo, *pair, out=files.at(i, out)))
        def inside(i, photo, pair=pair, out=out):
            one(i, photo)
            many = [seconds_of(chromakey(args, files, i, photo, *pair, frames=n)) for n in (5 * REPEATS, 0)]
            return (many[0] - many[1]) / (5 * REPEATS)
        run = one if whole else inside
        command = chromakey(args, files, *files.photos[0], *pair, **(dict(out=files.at(0, out)) if whole else dict(frames=5 * REPEATS)))
        comparison.add("ffmpeg chromakey + despill", tells, name, told(command), lambda run=run: files.mean(run),
                       beside="key", **files.straight(out))


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
    """What a person types: from a PNG to a file with alpha."""
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
        chromakeys(comparison, files, args, whole=True)
    for peer in comparison.peers[2:]:
        peer.beside = "key to PNG"
    comparison.finish()


def described(files):
    photo = files.photos[0][1]
    return f"{len(files.photos)} photo(s) of film on a screen, {photo.name}" + (" and others" if len(files.photos) > 1 else "")


def main():
    parser = arguments(__doc__)
    parser.add_argument("--truth", type=pathlib.Path, metavar="FOLDER", help="photos with truth instead of the drawn one")
    parser.add_argument("--most", type=int, default=4, help="photos of that folder to take (default: %(default)s)")
    parser.add_argument("--blender", default="blender", metavar="PROGRAM")
    parser.add_argument("--ffmpeg", default="ffmpeg", metavar="PROGRAM")
    args = parser.parse_args()
    photos = bottle.known(args.truth, args.most) if args.truth else [bottle.drawn()]
    files = Files(args.output / "matte", photos)
    comparison = Comparison("matte", args, INSIDE, described(files), ERROR, "the photo's own F and V")
    petcomps(comparison, files, args)
    with comparison.absent_if_it_fails("Blender Keying"):
        keying_node(comparison, files, args)
    with comparison.absent_if_it_fails("ffmpeg chromakey + despill"):
        chromakeys(comparison, files, args, whole=False)
    with comparison.absent_if_it_fails("PyMatting"):
        pymattings(comparison, files)
    comparison.finish()
    commands(files, args)


if __name__ == "__main__":
    main()

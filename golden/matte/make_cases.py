#!/usr/bin/env python3
"""Write the golden cases of the keyer: inputs, case.toml, and references made by Blender.

    python3 golden/matte/make_cases.py --blender blender --bpy42 PYTHON --bpy45 PYTHON

Without options only inputs are written.  Each version that is given remakes its cases.
"""

import argparse
import os
import shutil

import blenders
import exr_file
import pictures

HERE = os.path.dirname(os.path.abspath(__file__))
INPUTS = os.path.join(HERE, "inputs")

GREEN, BLUE, RED = (0.1, 0.75, 0.2), (0.1, 0.2, 0.8), (0.8, 0.2, 0.1)
GREY, CYAN, YELLOW, MAGENTA = (0.5, 0.5, 0.5), (0.1, 0.7, 0.7), (0.7, 0.7, 0.1), (0.7, 0.1, 0.7)
# Channels in Blender's own names; that of U is G.
CHANNELS = {"RGB": ("R", "G", "B"), "HSV": ("H", "S", "V"), "YUV": ("Y", "G", "V"), "YCC": ("Y", "CB", "CR")}
FALLOFFS = ("SMOOTH", "SPHERE", "ROOT", "INVERSE_SQUARE", "SHARP", "LINEAR")
ALL = dict(blur_pre=3, screen_balance=0.4, clip_black=0.1, clip_white=0.9, edge_kernel_radius=2,
           edge_kernel_tolerance=0.15, blur_post=2, dilate_distance=-3, feather_distance=3, feather_falloff="SHARP",
           despill_factor=0.8, despill_balance=0.3)
EXTREME = dict(blur_pre=60, clip_black=0.2, clip_white=0.7, edge_kernel_radius=70, blur_post=55, dilate_distance=80,
               feather_distance=-90)


def make_inputs():
    os.makedirs(INPUTS, exist_ok=True)

    def at(name):
        return os.path.join(INPUTS, name + ".exr")

    pictures.studio(at("green"), 24, 20, 1, GREEN)
    pictures.studio(at("green_64x48"), 64, 48, 2, GREEN)
    pictures.studio(at("blue"), 23, 17, 3, BLUE)
    pictures.wild(at("wild"), 21, 19, 4)
    pictures.odd(at("odd"), 16, 13, 5)
    pictures.wild(at("pixel"), 1, 1, 6)
    pictures.studio(at("strip"), 40, 1, 7, GREEN)
    pictures.studio(at("column"), 1, 37, 8, GREEN)
    pictures.plate(at("plate"), 24, 20, 9)
    pictures.plate(at("plate_ties"), 21, 19, 10, ties=True)
    pictures.odd(at("plate_odd"), 16, 13, 11)
    pictures.mask(at("garbage"), 24, 20, 12)
    pictures.mask(at("core"), 24, 20, 13)
    pictures.mask(at("beyond"), 24, 20, 14, -0.5, 1.7)
    pictures.odd(at("mask_odd"), 16, 13, 15)
    pictures.wild(at("pixel_other"), 21, 19, 16)


def keying_cases():
    """{name: (about, input, params)}; pictures among the params are names of inputs."""
    cases = {}

    def case(name, about, source="green", color=GREEN, **params):
        if "key_image" not in params:
            params["key_color"] = color
        cases[name] = (about, source, params)

    case("defaults", "a green screen, nothing set but its colour", "green_64x48")
    case("blue", "a blue screen", "blue", BLUE)
    case("wild", "high dynamic range, negative values, any alpha", "wild")
    case("odd", "NaN, infinities, subnormal and huge numbers", "odd")
    case("pixel", "a picture of one pixel, all stages on", "pixel", **ALL)
    case("strip", "a picture of one row, all stages on", "strip", **ALL)
    case("column", "a picture of one column, all stages on", "column", **ALL)
    for name, color in dict(grey=GREY, cyan=CYAN, yellow=YELLOW, magenta=MAGENTA, red=RED, white=(1, 1, 1)).items():
        case("key_" + name, "a key with its primary channel decided by a tie, or unlike the picture", "wild", color)
    case("balance_0", "balance at one end", screen_balance=0.0, despill_balance=0.0)
    case("balance_1", "balance at the other end", screen_balance=1.0, despill_balance=1.0)
    case("balance_0.3", "balance whose two roundings differ", "blue", BLUE, screen_balance=0.3)
    case("despill_0", "no despill", despill_factor=0.0)
    case("despill_0.35", "part of the despill, on wild values", "wild", despill_factor=0.35, despill_balance=0.2)
    for size in (1, 2, 5, 6):
        case("blur_pre_%d" % size, "chroma pre-blur alone", blur_pre=size)
    case("blur_pre_wild", "chroma pre-blur of wild values", "wild", blur_pre=4)
    case("blur_pre_odd", "infinities in the chroma pre-blur become NaN", "odd", blur_pre=3)
    case("clip", "levels with the edges left alone", clip_black=0.2, clip_white=0.8)
    case("clip_narrow", "levels close together, all but edges become 0 or 1", clip_black=0.45, clip_white=0.5)
    case("clip_equal", "white level at the black level", clip_black=0.5, clip_white=0.5)
    case("clip_inverted", "white level below the black level", clip_black=0.7, clip_white=0.2)
    case("clip_odd", "levels on a matte with NaN", "odd", clip_black=0.1, clip_white=0.9)
    for radius in (0, 1, 2, 7, 30):
        case("edge_radius_%d" % radius, "edge search with a window of that radius", edge_kernel_radius=radius,
             clip_black=0.1, clip_white=0.85, edge_kernel_tolerance=0.2)
    case("edge_tolerance_0", "nothing is alike", edge_kernel_tolerance=0.0, clip_black=0.1)
    case("edge_tolerance_1", "all but opposites are alike", edge_kernel_tolerance=1.0, clip_black=0.1)
    case("garbage", "a garbage matte", garbage_matte="garbage")
    case("core", "a core matte", core_matte="core")
    case("garbage_core", "both", garbage_matte="garbage", core_matte="core", clip_black=0.2)
    case("garbage_beyond", "a garbage matte above 1 and below 0", garbage_matte="beyond")
    case("mattes_beyond", "both, beyond 0 and 1, all stages on", garbage_matte="core", core_matte="beyond", **ALL)
    case("mattes_odd", "garbage and core with NaN and infinities", "odd", garbage_matte="mask_odd",
         core_matte="plate_odd")
    for size in (1, 2, 5, 6, 70):
        case("blur_post_%d" % size, "post-blur alone", blur_post=size)
    case("blur_post_odd", "post-blur of NaN", "odd", blur_post=3)
    for size in (1, 2, 3, 6, -2, -4, 33):
        case("dilate_%d" % size, "dilate or erode alone", dilate_distance=size)
    case("dilate_odd", "dilate ignores NaN", "odd", dilate_distance=3)
    for falloff in FALLOFFS:
        case("feather_" + falloff.lower(), "feather alone", feather_distance=5, feather_falloff=falloff)
    case("feather_inward", "feather inwards", feather_distance=-4)
    case("feather_wide", "a feather wider than the picture", feather_distance=40, feather_falloff="LINEAR")
    case("feather_odd", "feather of NaN", "odd", feather_distance=3, feather_falloff="ROOT")
    case("feather_beyond", "feather of values below 0 and above 1", garbage_matte="beyond", core_matte="garbage",
         feather_distance=4)
    case("all", "all stages on", "green_64x48", **ALL)
    case("all_other", "all stages on, other signs", "blue", BLUE, **dict(ALL, dilate_distance=4, feather_distance=-6))
    case("all_wild", "all stages on, wild values", "wild", **ALL)
    case("all_odd", "all stages on, NaN and infinities", "odd", **ALL)
    case("extreme", "every window larger than the picture", "green", **EXTREME)
    case("plate", "a key for every pixel", key_image="plate")
    case("plate_ties", "a plate of cyan, yellow, grey and negative pixels", "wild", key_image="plate_ties")
    case("plate_odd", "a plate with NaN and infinities", "odd", key_image="plate_odd")
    case("plate_all", "a key for every pixel, all stages on", key_image="plate", **ALL)
    return cases


def other_cases():
    """{name: (node, about, input, params)} of the nodes that 3.4 and 4.5 have in different form."""
    cases = {}
    for name, source, color in (("green", "green_64x48", GREEN), ("wild", "wild", CYAN)):
        cases["chroma_key_" + name] = ("chroma_key", "chroma key with its defaults", source, dict(key_color=color))
        cases["chroma_key_narrow_" + name] = ("chroma_key", "chroma key between narrow angles", source, dict(
            key_color=color, threshold=0.05, tolerance=0.3, gain=0.4))
    for space, channel, other in (("RGB", "G", "R"), ("HSV", "S", "H"), ("YUV", "V", "G"), ("YCC", "CB", "CR")):
        name = "channel_key_" + space.lower()
        cases[name] = ("channel_key", "channel key by the larger of the others", "wild", dict(
            color_space=space, matte_channel=channel, limit_method="MAX", limit_min=0.1, limit_max=0.9))
        cases[name + "_single"] = ("channel_key", "channel key by one other channel", "wild", dict(
            color_space=space, matte_channel=channel, limit_method="SINGLE", limit_channel=other, limit_min=0.2,
            limit_max=0.7))
    for tolerance, falloff in ((0.1, 0.1), (0.3, 0.5), (0.2, 0.0)):
        cases["difference_key_%g_%g" % (tolerance, falloff)] = ("difference_key", "difference key", "wild", dict(
            second_image="pixel_other", tolerance=tolerance, falloff=falloff))
    for channel, limit in (("R", "G"), ("G", "B"), ("B", "R")):
        cases["color_spill_" + channel.lower()] = ("color_spill", "spill against one channel", "wild", dict(
            channel=channel, limit_method="SIMPLE", limit_channel=limit, ratio=0.9, fac=0.7))
        cases["color_spill_unspill_" + channel.lower()] = ("color_spill", "spill handed to other channels", "wild", dict(
            channel=channel, limit_method="AVERAGE", ratio=1.1, fac=1.0, use_unspill=True, unspill_red=0.2,
            unspill_green=0.9, unspill_blue=0.5))
    return cases


def toml(value):
    if isinstance(value, str):
        return '"%s"' % value
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (tuple, list)):
        return "[%s]" % ", ".join(toml(float(v)) for v in value)
    return repr(value)


def write_case(folder, version, node, about, source, params):
    os.makedirs(folder)
    given = {"input": source}
    for name, to in (("key_image", "plate"), ("garbage_matte", "garbage"), ("core_matte", "core"),
                     ("second_image", "second")):
        if name in params:
            given[to] = params[name]
    lines = ["about = %s" % toml(about), "node = %s" % toml(node)]
    lines += ["%s = %s" % (name, toml("../inputs/%s.exr" % value)) for name, value in given.items()]
    if "key_color" in params:
        lines.append("screen = %s" % toml(params["key_color"]))
    settings = {n: v for n, v in params.items() if n not in blenders.GIVEN_ELSEWHERE}
    for name in ("matte_channel", "limit_channel"):
        if node == "channel_key" and name in settings:
            settings[name] = CHANNELS[settings["color_space"]].index(settings[name])
    lines += ["", "[options]", "profile = %s" % toml(blenders.PROFILES[version])]
    lines += ["%s = %s" % (name, toml(value)) for name, value in settings.items()]
    lines += ["", "[reference]", 'program = "Blender"', 'version = "%s"' % version,
              'script = "golden/matte/keying_reference.py"', ""]
    with open(os.path.join(folder, "case.toml"), "w", encoding="utf-8") as out:
        out.write("\n".join(lines))


def job(folder, node, source, params):
    pictures_of = {n: os.path.join(INPUTS, v + ".exr") for n, v in params.items() if n in blenders.PICTURES}
    outputs = {"Image": "reference"}
    if node != "color_spill":
        outputs["Matte"] = "reference_matte"
    if node == "keying":
        outputs["Edges"] = "reference_edges"
    return dict(node=node, input=os.path.join(INPUTS, source + ".exr"), params={**params, **pictures_of},
                prefix=folder + os.sep, outputs=outputs)


def plain(path):
    """Leave nothing but the samples of a reference, so that remaking it gives the same bytes; one channel of a matte."""
    width, height, channels = exr_file.read(path)
    if len(channels) == 3:
        channels = {"Y": channels["R"]}
    elif len(channels) == 1:
        channels = {"Y": next(iter(channels.values()))}
    exr_file.write(path, width, height, channels)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    blenders.add_arguments(parser)
    commands = blenders.chosen(parser.parse_args())
    make_inputs()
    keying = {n: ("keying", *c) for n, c in keying_cases().items()}
    for version in blenders.VERSIONS:
        if version not in commands:
            continue
        jobs = []
        for name, (node, about, source, params) in {**keying, **other_cases()}.items():
            folder = os.path.join(HERE, "%s_%s" % (name, version))
            shutil.rmtree(folder, ignore_errors=True)
            write_case(folder, version, node, about, source, params)
            jobs.append(job(folder, node, source, params))
        blenders.run(version, commands[version], jobs)
        for done in jobs:
            for name in done["outputs"].values():
                plain(done["prefix"] + name + ".exr")
        print("Blender %s: %d cases" % (version, len(jobs)))


if __name__ == "__main__":
    main()

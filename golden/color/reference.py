"""Reference values of colour, computed by the package colour-science.

    pip install colour-science==0.4.7
    python golden/color/reference.py

Writes golden/color/<case>/reference.json. Every input is a float32 written exactly, so that nothing is lost before the
first operation; every result is a float64.
"""

import json
import pathlib
import warnings

import numpy as np

warnings.filterwarnings("ignore")
import colour  # noqa: E402  (it warns of optional packages while it is imported)

HERE = pathlib.Path(__file__).parent
VERSION = "0.4.7"


def exact(values):
    """The nearest float32 values, as float64."""
    return np.asarray(values, dtype=np.float32).astype(np.float64)


def colors(count, low, high, seed):
    """Random colours."""
    return exact(np.random.default_rng(seed).uniform(low, high, (count, 3)))


def write(case, table):
    """Numbers are written so that they are read back without a change."""
    plain = json.dumps(table, default=lambda array: array.tolist(), indent=None)
    (HERE / case / "reference.json").write_text(plain.replace('], "', '],\n "') + "\n")


def curves():
    """Light and its encoded value, both ways, at zero, at both sides of every knee, above one."""
    samples = exact(
        np.concatenate(
            [
                [0, 1e-8, 1e-4, 0.003, 0.00313, 0.003132, 0.01799, 0.01801, 0.0404, 0.0405, 0.0809, 0.0813],
                np.linspace(0.02, 1, 50),
                [1.5, 4, 100],
            ]
        )
    )
    gamma = colour.gamma_function
    table = {
        "srgb": (colour.models.eotf_inverse_sRGB, colour.models.eotf_sRGB),
        "rec709": (colour.models.oetf_BT709, colour.models.oetf_inverse_BT709),
        "gamma_2.2": (lambda x: gamma(x, 1 / 2.2), lambda v: gamma(v, 2.2)),
        "gamma_2.6": (lambda x: gamma(x, 1 / 2.6), lambda v: gamma(v, 2.6)),
    }
    curve = {name: {"encoded": encode(samples), "decoded": decode(samples)} for name, (encode, decode) in table.items()}
    write("curves", {"samples": samples, "curves": curve})


def spaces():
    """Matrices and colours; names are target_from_source."""
    names = {"rec709": "sRGB", "rec2020": "ITU-R BT.2020", "acescg": "ACEScg"}
    rgb = {key: colour.RGB_COLOURSPACES[name].copy() for key, name in names.items()}
    for space in rgb.values():
        space.use_derived_transformation_matrices(True)
    matrices = {f"xyz_from_{key}": space.matrix_RGB_to_XYZ for key, space in rgb.items()}
    for source in rgb:
        for target in rgb:
            if source != target:
                matrix = colour.matrix_RGB_to_RGB(rgb[source], rgb[target], "Bradford")
                matrices[f"{target}_from_{source}"] = matrix
    whites = [colour.xy_to_XYZ(rgb[key].whitepoint) for key in ("rec709", "acescg")]
    adapt = colour.adaptation.matrix_chromatic_adaptation_VonKries
    matrices["bradford_acescg_from_rec709"] = adapt(whites[0], whites[1], transform="Bradford")
    matrices["bradford_rec709_from_acescg"] = adapt(whites[1], whites[0], transform="Bradford")

    linear = np.vstack([exact([[0.18, 0.5, 0.9], [1, 1, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), colors(20, -0.5, 4, 1)])
    table = {"linear": linear, "xyz": linear @ matrices["xyz_from_rec709"].T}
    table["acescg"] = colour.RGB_to_RGB(linear, rgb["rec709"], rgb["acescg"], "Bradford")
    write("spaces", {"matrices": matrices, "colors": table})


def hsv():
    """Colours of any size and sign, but none whose largest channel is 0."""
    rgb = np.vstack(
        [
            exact([[0.5, 0.5, 0.5], [2, 0, 0], [0, 2, 0], [0, 0, 2], [3, 3, 0], [0, 3, 3], [3, 0, 3], [-0.2, 0.3, 1.5]]),
            exact([[-0.2, -0.3, -0.5], [-1, -1, -1]]),
            colors(30, 0, 1, 2),
            colors(30, -1, 3, 3),
        ]
    )
    rgb = rgb[rgb.max(axis=1) != 0]
    polar = exact(colors(30, 0, 1, 4) * [1, 1, 3])
    table = {"rgb": rgb, "hsv_of_rgb": colour.RGB_to_HSV(rgb), "hsv": polar, "rgb_of_hsv": colour.HSV_to_RGB(polar)}
    write("hsv", table)


if __name__ == "__main__":
    assert colour.__version__ == VERSION, f"colour-science {colour.__version__}, expected {VERSION}"
    for case in (curves, spaces, hsv):
        (HERE / case.__name__).mkdir(exist_ok=True)
        case()

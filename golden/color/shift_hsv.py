"""Reference values of color::shift_hsv, rendered by Cycles.

    blender --background --factory-startup --python golden/color/shift_hsv.py

A card with one texel to a pixel glows with the output of the Hue Saturation Value node, seen by an orthographic camera
at one sample a pixel through a box filter far narrower than a texel: every pixel is the node's value of one colour.
Writes golden/color/shift_hsv/reference.json.
"""

import json
import os
import pathlib
import tempfile

import bpy
import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
WIDTH, HEIGHT = 16, 8
# Degrees of hue, factor of saturation, factor of value.
SETTINGS = [(0, 1, 1), (20, 1, 1), (-75, 1.3, 0.8), (180, 0.4, 1.7), (0, 3, 1), (300, 0, 2)]


def colors():
    """Rows of float32: random ones from 0 to 1 and to 4, greys, and the corners of the cube."""
    random = np.random.default_rng(7)
    corners = [[r, g, b] for r in (0, 1) for g in (0, 1) for b in (0, 1)]
    greys = [[v, v, v] for v in np.linspace(0.01, 3, 8)]
    count = WIDTH * HEIGHT - len(corners) - len(greys)
    drawn = random.uniform(0, 1, (count, 3)) * np.where(np.arange(count) % 3 == 0, 4, 1)[:, None]
    return np.vstack([corners, greys, drawn]).astype(np.float32)


def texture(values):
    image = bpy.data.images.new("texture", WIDTH, HEIGHT, alpha=False, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    opaque = np.ones((WIDTH * HEIGHT, 4), np.float32)
    opaque[:, :3] = values
    image.pixels.foreach_set(opaque.ravel())
    image.update()
    return image


def card(values):
    """Glowing card; returns the node to be set."""
    bpy.ops.mesh.primitive_plane_add(size=1)
    plane = bpy.context.object
    plane.scale = (WIDTH, HEIGHT, 1)
    material = bpy.data.materials.new("glow")
    material.use_nodes = True
    nodes, link = material.node_tree.nodes, material.node_tree.links.new
    nodes.clear()
    texels = nodes.new("ShaderNodeTexImage")
    texels.image, texels.interpolation = texture(values), "Closest"
    shift, glow = nodes.new("ShaderNodeHueSaturation"), nodes.new("ShaderNodeEmission")
    link(texels.outputs["Color"], shift.inputs["Color"])
    link(shift.outputs["Color"], glow.inputs["Color"])
    link(glow.outputs["Emission"], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    plane.data.materials.append(material)
    return shift


def prepare():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.object.camera_add(location=(0, 0, 1))
    scene.camera = bpy.context.object
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", WIDTH
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.use_denoising = 1, False, False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = WIDTH, HEIGHT, 100
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.view_settings.view_transform = "Raw"
    return scene


def rendered(scene, shift, folder, degrees, saturation, value):
    shift.inputs["Hue"].default_value = (0.5 + degrees / 360) % 1
    shift.inputs["Saturation"].default_value = saturation
    shift.inputs["Value"].default_value = value
    scene.render.filepath = os.path.join(folder, "out.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(WIDTH * HEIGHT * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(-1, 4)[:, :3]


def main():
    assert bpy.app.version_string == "3.4.1", f"Blender {bpy.app.version_string}, expected 3.4.1"
    scene, values = prepare(), colors()
    shift = card(values)
    with tempfile.TemporaryDirectory() as folder:
        shifts = [
            {"hue_deg": d, "saturation": s, "value": v, "rgb": plain(rendered(scene, shift, folder, d, s, v))}
            for d, s, v in SETTINGS
        ]
    (HERE / "shift_hsv").mkdir(exist_ok=True)
    table = json.dumps({"rgb": plain(values), "shifts": shifts})
    (HERE / "shift_hsv" / "reference.json").write_text(table.replace("}, {", "},\n {") + "\n")


def plain(values):
    """Lists of the shortest decimals that name the float32 values."""
    return [[float(str(x)) for x in row] for row in values.astype(np.float32)]


main()

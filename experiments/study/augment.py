"""Ultralytics' augmentations on the training GPU, which would otherwise wait for the CPU.

The default settings without albumentations: mosaics of four pictures, scaled, shifted and mirrored, with changes of hue,
saturation and value.
"""

import cv2
import numpy as np
import torch
import torch.nn.functional as F

from . import files

SCALE, SHIFT = 0.5, 0.1
HUE, SATURATION, VALUE = 0.015, 0.7, 0.4
GREY = 114.0
# Boxes that are left of those which a picture's edge cuts: pixels, and shares of their area.
LEAST_SIDE, LEAST_AREA, MOST_ASPECT = 2.0, 0.1, 100.0
# Corners of a picture that lie at the centre of a mosaic: of the upper left one the lower right corner.
MOSAIC_CORNERS = np.array([[1, 1], [0, 1], [1, 0], [0, 0]])


class Pictures:
    """All pictures of a source, RGB on the GPU, with boxes as corners relative to the picture size. The pictures of all
    sources have the same size."""

    def __init__(self, paths, classes, device):
        self.paths = paths
        pixels = np.stack([cv2.imread(path)[..., ::-1] for path in paths])
        self.pixels = torch.from_numpy(pixels).permute(0, 3, 1, 2).contiguous().to(device)
        rows = [read_rows(files.label_of(path)) for path in paths]
        self.kinds = [each[:, 0] * (classes > 1) for each in rows]
        self.boxes = [corners_of(each[:, 1:]) for each in rows]

    def __len__(self):
        return len(self.paths)


def read_rows(label):
    return np.array([line.split() for line in label.read_text().splitlines()], float).reshape(-1, 5)


def corners_of(boxes):
    """Convert boxes from centre and size to top left and bottom right corner."""
    centre, half = boxes[:, :2], boxes[:, 2:] / 2
    return np.hstack([centre - half, centre + half])


class Loader:
    """Batches in the form that Ultralytics' trainer expects. Each of the `sources` has its own mosaics; `batches` are
    indices into all of them."""

    num_workers = 0
    drop_last = True

    def __init__(self, sources, batches, size, seed):
        self.sources, self.batches, self.size, self.seed = sources, batches, size, seed
        self.batch_size = batches.batch
        self.is_mosaic = True
        # What the trainer asks of these it asks of the loader.
        self.dataset = self.sampler = self

    def __len__(self):
        return len(self.batches)

    def __iter__(self):
        for number in self.batches.numbers():
            yield self.made(np.random.default_rng([self.seed, number]), self.batches.indices(number))

    def reset(self):
        """Do nothing: there are no workers to restart."""

    def close_mosaic(self, hyp):
        self.is_mosaic = False

    def made(self, rng, indices):
        chosen = [self.chosen(rng, index) for index in indices]
        places = [self.placed(rng, source) for source, _ in chosen]
        pixels = torch.stack([torch.stack([source.pixels[k] for k in parts]) for source, parts in chosen])
        image = composed(pixels.float(), places, self.size)
        is_mirrored = rng.random(len(indices)) < 0.5
        gains = rng.uniform(-1, 1, (len(indices), 3)) * (HUE, SATURATION, VALUE)
        boxes = [
            boxes_of(source, parts, place, self.size, flipped)
            for (source, parts), place, flipped in zip(chosen, places, is_mirrored)
        ]
        rows = np.concatenate(boxes)
        owner = np.repeat(np.arange(len(boxes)), [len(each) for each in boxes])
        return {
            "img": mirrored(recoloured(image, gains), is_mirrored),
            "cls": torch.from_numpy(rows[:, :1]).float(),
            "bboxes": torch.from_numpy(rows[:, 1:]).float(),
            "batch_idx": torch.from_numpy(owner).float(),
            "im_file": [source.paths[parts[0]] for source, parts in chosen],
        }

    def chosen(self, rng, index):
        """Return the source of a picture and the pictures of its mosaic."""
        for source in self.sources:
            if index < len(source):
                others = rng.integers(len(source), size=3) if self.is_mosaic else []
                return source, [index, *others]
            index -= len(source)

    def placed(self, rng, source):
        """Return a canvas of pictures and its position in the result."""
        height, width = source.pixels.shape[2:]
        sides = np.array([width, height]) * self.size / max(width, height)
        if self.is_mosaic:
            canvas = 2 * self.size
            centre = rng.uniform(self.size / 2, canvas - self.size / 2, 2)
            corners = centre - MOSAIC_CORNERS * sides
        else:
            canvas = self.size
            corners = (canvas - sides)[None] / 2
        return {
            "sides": sides,
            "corners": corners,
            "canvas": canvas,
            "scale": rng.uniform(1 - SCALE, 1 + SCALE),
            "shift": rng.uniform(0.5 - SHIFT, 0.5 + SHIFT, 2) * self.size,
        }


def composed(pixels, places, size):
    """Compose [batch, parts, 3, height, width] to [batch, 3, size, size]; bilinear."""
    result = pixels.new_full((len(places), 3, size, size), GREY)
    for part in range(pixels.shape[1]):
        across, down = (sources(places, part, axis, size, pixels.device) for axis in (0, 1))
        grid = torch.stack(torch.broadcast_tensors(across[:, None, :], down[:, :, None]), -1)
        sampled = F.grid_sample(pixels[:, part], grid, padding_mode="border", align_corners=False)
        is_inside = (grid.abs() <= 1).all(-1)[:, None]
        result = torch.where(is_inside, sampled, result)
    return result


def sources(places, part, axis, size, device):
    """Positions in a picture that pixels of the result come from, -1 to 1 inside it; [batch, size]."""
    pixel = np.arange(size) + 0.5
    rows = []
    for place in places:
        of_canvas = (pixel - place["shift"][axis]) / place["scale"] + place["canvas"] / 2
        of_picture = (of_canvas - place["corners"][part, axis]) / place["sides"][axis] * 2 - 1
        # Nothing is outside of the canvas.
        rows.append(np.where((of_canvas >= 0) & (of_canvas <= place["canvas"]), of_picture, 2.0))
    return torch.from_numpy(np.stack(rows)).float().to(device)


def boxes_of(source, parts, place, size, is_mirrored):
    """Rows of class, centre and size, relative to the result, of the visible parts of boxes."""
    kinds = np.concatenate([source.kinds[part] for part in parts])
    sides = np.tile(place["sides"], 2)
    on_canvas = [source.boxes[part] * sides + np.tile(corner, 2) for part, corner in zip(parts, place["corners"])]
    whole = np.concatenate(on_canvas).clip(0, place["canvas"])
    whole = (whole - place["canvas"] / 2) * place["scale"] + np.tile(place["shift"], 2)
    seen = whole.clip(0, size)
    kept = is_left(whole[:, 2:] - whole[:, :2], seen[:, 2:] - seen[:, :2])
    centre, sides = (seen[kept, 2:] + seen[kept, :2]) / 2, seen[kept, 2:] - seen[kept, :2]
    if is_mirrored:
        centre[:, 0] = size - centre[:, 0]
    return np.hstack([kinds[kept, None], centre / size, sides / size])


def is_left(whole, seen):
    tiny = 1e-9
    area = seen.prod(1) / np.maximum(whole.prod(1), tiny)
    aspect = seen.max(1) / np.maximum(seen.min(1), tiny)
    return (seen.min(1) > LEAST_SIDE) & (area > LEAST_AREA) & (aspect < MOST_ASPECT)


def recoloured(image, gains):
    """Shift the hue of each picture by a fraction of the circle and scale saturation and value; 0 to 255."""
    hue_gain, saturation_gain, value_gain = torch.from_numpy(gains).float().to(image.device)[..., None, None].unbind(1)
    red, green, blue = (image / 255).unbind(1)
    value, _ = image.max(1)
    value = value / 255
    chroma = value - image.min(1)[0] / 255
    by_chroma = 1 / chroma.clamp(min=1e-6)
    sixth = torch.where(
        value == red,
        (green - blue) * by_chroma,
        torch.where(value == green, (blue - red) * by_chroma + 2, (red - green) * by_chroma + 4),
    )
    sixth = sixth + 6 * hue_gain
    saturation = (chroma / value.clamp(min=1e-6) * (1 + saturation_gain)).clamp(0, 1)
    value = (value * (1 + value_gain)).clamp(0, 1)
    channels = []
    for channel in (5, 3, 1):
        k = (channel + sixth) % 6
        channels.append(value - value * saturation * torch.minimum(k, 4 - k).clamp(0, 1))
    return torch.stack(channels, 1) * 255


def mirrored(image, is_mirrored):
    where = torch.from_numpy(is_mirrored).to(image.device)[:, None, None, None]
    return torch.where(where, image.flip(-1), image)

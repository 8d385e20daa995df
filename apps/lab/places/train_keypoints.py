#!/usr/bin/python3
"""Trains the network that describes keypoints by 24 numbers, and writes it as ONNX.

Recordings are "KIND PATH" as in views.py, with depth images. The patches are those of robots (kimera_multi_vocabulary
patches). Two patches of different views are a pair if depth and poses put both keypoints at one place. The loss makes
the patch of a pair more similar than all others of the batch, most of which are of the same image (Oord et al.,
"Representation learning with contrastive predictive coding", 2018, Eq. 4).
"""
import argparse
import pathlib
import subprocess
import tempfile

import numpy as np
import torch
import torch.nn.functional as F
from torch import nn

import training
import views

SIDE = 24  # as in keypoint_patches.hpp
NUMBERS, STEPS, LARGEST = 24, 3.5, 7  # as in matched_numbers.hpp
PYRAMID = 1.2  # factor between octaves
RADIUS = 1.5  # [px of the coarser octave] within which two keypoints are one
MAX_SCALE = 1.5  # between two keypoints of a pair
NEAR = 12.0  # [px] keypoints this near are neither one nor two
OVERLAP = 0.15  # shared surface from which two views are compared
PAIRS = 64  # keypoints of two views in a batch
TEMPERATURE = 0.05  # of the cosine


class KeypointNetwork(nn.Module):
    """Patches (n x 1 x 24 x 24, mean 0, deviation 1) to 24 numbers each."""

    def __init__(self, width):
        super().__init__()
        layers = []
        for inputs, outputs in ((1, width), (width, 2 * width), (2 * width, 4 * width)):
            layers += [nn.Conv2d(inputs, outputs, 3, 2, 1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU()]
        # Without scale and shift: all numbers have one range, because they are rounded to the same steps.
        layers += [nn.Flatten(), nn.Linear(4 * width * 9, NUMBERS, bias=False), nn.BatchNorm1d(NUMBERS, affine=False)]
        self.layers = nn.Sequential(*layers)

    def forward(self, patches):
        return self.layers(patches)

    def folded(self):
        """The network for use, with the last normalization in the last layer: OpenCV runs that faster."""
        linear, norm = self.layers[-2:]
        scale = (norm.running_var + norm.eps).rsqrt()
        last = nn.Linear(linear.in_features, NUMBERS)
        last.weight.data, last.bias.data = scale[:, None] * linear.weight.data, -scale * norm.running_mean
        return nn.Sequential(*self.layers[:-2], last).eval()


def normalized(patches):
    """Mean 0 and deviation 1 of each patch, as keypoint_describer.hpp does it."""
    centered = patches - patches.mean((1, 2, 3), keepdim=True)
    return centered / centered.pow(2).mean((1, 2, 3), keepdim=True).sqrt().clamp(min=1.0)


def augmented(patches, random):
    """The patches slightly turned, scaled, moved, in other light, blurred, with noise."""
    n = len(patches)
    uniform = lambda low, high, *shape: torch.tensor(random.uniform(low, high, (n, *shape)), dtype=torch.float32)
    angle, zoom, stretch = uniform(-0.25, 0.25), uniform(0.85, 1.15), uniform(0.8, 1.25)
    cosine, sine = zoom * angle.cos(), zoom * angle.sin()
    affine = torch.stack([torch.stack([cosine * stretch, -sine, uniform(-0.06, 0.06)], 1),
                          torch.stack([sine * stretch, cosine, uniform(-0.06, 0.06)], 1)], 1)
    grid = F.affine_grid(affine, patches.shape, align_corners=False)
    patches = F.grid_sample(patches, grid, padding_mode="border", align_corners=False)
    patches = 255 * (patches / 255).clamp(0, 1) ** torch.exp(uniform(-0.5, 0.5, 1, 1, 1))
    soft = F.avg_pool2d(patches, 3, 1, 1, count_include_pad=False)
    patches = patches + uniform(-0.5, 1, 1, 1, 1).clamp(min=0) * (soft - patches)
    return normalized(patches + torch.randn(patches.shape) * uniform(0, 4, 1, 1, 1))


def depth_at(view, pixels):
    scale = view.depth.shape[1] / view.camera.size[0]
    at = np.clip((pixels * scale).astype(int), 0, np.array(view.depth.shape[::-1]) - 1)
    return view.depth[at[:, 1], at[:, 0]]


def pairs_of(a, b, rows_a, rows_b):
    """Places of keypoints in rows_a and rows_b that show one point: in both directions the nearest."""
    pixels = np.stack([rows_a["x"], rows_a["y"]], 1).astype(float)
    z = depth_at(a, pixels)
    world = views.apply(a.T_world_cam, a.camera.unproject(pixels) * z[:, None])
    points = views.apply(np.linalg.inv(b.T_world_cam), world)
    usable = (z > 0) & (points[:, 2] > 0.1)
    points[~usable] = (0, 0, 1)
    projected = b.camera.project(points)
    theirs = np.stack([rows_b["x"], rows_b["y"]], 1)
    distances = np.linalg.norm(projected[:, None] - theirs[None], axis=2)
    scale_a, scale_b = PYRAMID ** rows_a["octave"].astype(float), PYRAMID ** rows_b["octave"].astype(float)
    ratio = scale_a[:, None] * z[:, None] / points[:, 2:] / scale_b[None]
    coarser = np.maximum(scale_a[:, None] * z[:, None] / points[:, 2:], scale_b[None])
    wrong = ~usable[:, None] | (np.abs(np.log(np.maximum(ratio, 1e-6))) > np.log(MAX_SCALE))
    cost = np.where(wrong, np.inf, distances / np.maximum(coarser, 1))
    nearest = cost.argmin(1)
    good = (cost.min(1) < RADIUS) & (cost.argmin(0)[nearest] == np.arange(len(rows_a)))
    seen = depth_at(b, theirs[nearest])
    good &= np.abs(seen - points[:, 2]) < 0.1 * points[:, 2] + 0.05
    return np.flatnonzero(good), nearest[good]


class Recording:
    """The patches of a recording and the pairs among them."""

    def __init__(self, recording, options):
        self.name = recording
        file = options.cache / (recording.replace("/", "_").replace(" ", "_") + ".npz")
        if not file.exists():
            self.make(recording, file, options)
        data = np.load(file)
        self.patches, self.pixels = data["patches"], data["pixels"]
        self.orb, self.starts, self.pairs = data["orb"], data["starts"], data["pairs"]
        self.links = np.split(data["links"], np.cumsum(data["counts"])[:-1])
        self.angles = data["angles"]

    def make(self, recording, file, options):
        found = views.read_views(recording)
        with tempfile.TemporaryDirectory() as folder:
            listing, output = pathlib.Path(folder) / "images.txt", pathlib.Path(folder) / "patches.npy"
            listing.write_text("".join(f"{view.image.resolve()}\n" for view in found))
            subprocess.run([options.programs / "kimera_multi_vocabulary", "patches", listing, "-o", output,
                            "--features", str(options.features)], check=True)
            rows = np.load(output)
        starts = np.searchsorted(rows["image"], np.arange(len(found) + 1))
        overlaps, angles = views.overlaps(found), views.angles_deg(found)
        candidates = np.argwhere(np.triu(overlaps > OVERLAP, 1))
        np.random.default_rng(1).shuffle(candidates)
        pairs, links = [], []
        for i, j in candidates[:options.view_pairs]:
            a, b = pairs_of(found[i], found[j], rows[starts[i]:starts[i + 1]], rows[starts[j]:starts[j + 1]])
            if len(a) >= 16:
                pairs.append((i, j))
                links.append(np.stack([starts[i] + a, starts[j] + b], 1))
        pairs = np.array(pairs)
        print(recording, len(found), "views,", len(pairs), "pairs,", sum(map(len, links)), "links", flush=True)
        np.savez(file, patches=rows["patch"], orb=rows["orb"], pixels=np.stack([rows["x"], rows["y"]], 1),
                 starts=starts, pairs=pairs, links=np.concatenate(links), counts=[len(link) for link in links],
                 angles=angles[pairs[:, 0], pairs[:, 1]])


def batch_of(recordings, count, random):
    """Rows of `count` pairs of views, patches of both, and which of them are too near to be compared."""
    a, b, near = [], [], []
    for _ in range(count):
        recording = recordings[random.integers(len(recordings))]
        # Few views differ by large angles; these are chosen as often as the others.
        bins = np.digitize(recording.angles, (10, 25, 45))
        chosen = np.flatnonzero(bins == random.choice(np.unique(bins)))
        link = recording.links[random.choice(chosen)]
        link = link[random.permutation(len(link))[:PAIRS]]
        a.append(recording.patches[link[:, 0]])
        b.append(recording.patches[link[:, 1]])
        pixels = recording.pixels[link[:, 1]]
        near.append(torch.tensor(np.linalg.norm(pixels[:, None] - pixels[None], axis=2) < NEAR))
    to_tensor = lambda parts: torch.tensor(np.concatenate(parts), dtype=torch.float32)[:, None]
    near = torch.block_diag(*near)
    return to_tensor(a), to_tensor(b), near & ~torch.eye(len(near), dtype=torch.bool)


def rounded(numbers):
    """Directions in steps, as matched_numbers.hpp rounds them, over the steps of 1; gradients are those without rounding."""
    direction = F.normalize(numbers, dim=1) * NUMBERS**0.5
    steps = (STEPS * direction).clamp(-LARGEST, LARGEST).round()
    return direction + (steps / STEPS - direction).detach()


def contrastive_loss(a, b, near):
    logits = a @ b.T / NUMBERS / TEMPERATURE
    targets = torch.arange(len(a))
    return 0.5 * (F.cross_entropy(logits.masked_fill(near, -1e9), targets) +
                  F.cross_entropy(logits.T.masked_fill(near.T, -1e9), targets))


def export(network, path):
    network.eval()
    torch.onnx.export(network.folded(), torch.zeros(1, 1, SIDE, SIDE), path, opset_version=11, input_names=["patches"],
                      output_names=["numbers"], dynamic_axes={"patches": {0: "n"}, "numbers": {0: "n"}})


def report(name, recording, distances, random):
    """Matches of two views by the rules of matching.hpp, and how many of them are right."""
    rows = []
    for low, high in ((0, 15), (15, 30), (30, 60), (60, 180)):
        chosen = np.flatnonzero((recording.angles >= low) & (recording.angles < high))
        right = wrong = links = 0
        for k in random.permutation(chosen)[:40]:
            (i, j), link = recording.pairs[k], recording.links[k]
            d = distances(slice(*recording.starts[i:i + 2]), slice(*recording.starts[j:j + 2]))
            best = d.argmin(1)
            ordered = np.sort(d, 1)
            good = (ordered[:, 0] <= 24) & (ordered[:, 0] < 0.85 * ordered[:, 1])
            good &= d.argmin(0)[best] == np.arange(len(d))
            truth = {p - recording.starts[i]: q - recording.starts[j] for p, q in link}
            for p in np.flatnonzero(good):
                if p not in truth:
                    continue
                gap = np.linalg.norm(recording.pixels[recording.starts[j] + best[p]] -
                                     recording.pixels[recording.starts[j] + truth[p]])
                right, wrong = right + (gap < 4), wrong + (gap > NEAR)
            links += len(link)
        rows.append(f"{right}+{wrong}/{links}" if links else "-")
    print(f"{name:10} {recording.name:24} right+wrong/links by angle: {'  '.join(rows)}", flush=True)


def distances_of(network, patches):
    """Function of two slices: the distances of their keypoints, as 96 parts of the largest one."""
    network.eval()
    parts = np.array_split(patches, len(patches) // 2000 + 1)
    with torch.no_grad():
        numbers = torch.cat([rounded(network(normalized(torch.tensor(part, dtype=torch.float32)[:, None])))
                             for part in parts]).numpy()
    squares = (numbers**2).sum(1)
    return lambda a, b: (squares[a, None] + squares[None, b] - 2 * numbers[a] @ numbers[b].T) * 96 / (4 * NUMBERS)


def orb_distances_of(orb):
    signs = 2.0 * np.unpackbits(orb[:, :12], axis=1).astype(np.float32) - 1
    return lambda a, b: (96 - signs[a] @ signs[b].T) / 2


def known_steps(network):
    """The steps of a known patch, for the test of the shipped network (test_keypoint_describer.cpp)."""
    x, y = np.meshgrid(2 * np.arange(SIDE) - 23, 2 * np.arange(SIDE) - 23)
    patch = np.rint(128 + 60 * np.sin(0.12 * x) + 50 * np.cos(0.09 * y + 0.05 * x))
    with torch.no_grad():
        steps = STEPS * rounded(network(normalized(torch.tensor(patch, dtype=torch.float32)[None, None])))
    return steps.round().int().flatten().tolist()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", nargs="+")
    parser.add_argument("--judged", nargs="*", default=[], help="recordings whose matches are counted at the end")
    training.define_options(parser, steps=14000)
    parser.add_argument("--programs", type=pathlib.Path, default=pathlib.Path("build/bin"))
    parser.add_argument("--features", type=int, default=500, help="keypoints of an image")
    parser.add_argument("--view-pairs", type=int, default=1500, help="most pairs of views of a recording")
    parser.add_argument("--width", type=int, default=8, help="maps of the first layer")
    parser.add_argument("--batch", type=int, default=8, help="pairs of views in a batch")
    options = parser.parse_args()
    random = training.prepare(options)
    recordings = [Recording(recording, options) for recording in options.recordings]
    network = KeypointNetwork(options.width)

    def loss_of_batch():
        a, b, near = batch_of(recordings, options.batch, random)
        numbers = network(torch.cat([augmented(a, random), augmented(b, random)]))
        return contrastive_loss(rounded(numbers[:len(a)]), rounded(numbers[len(a):]), near)

    for step, loss in training.optimized(network, options, 3e-3, loss_of_batch):
        if step % 100 == 0:
            print(f"{step} steps, loss {loss:.3f}", flush=True)
    export(network, options.output)
    print("known steps:", known_steps(network))
    print(sum(p.numel() for p in network.parameters()), "parameters,", options.output.stat().st_size, "bytes")
    for recording in (Recording(recording, options) for recording in options.judged):
        report("ORB", recording, orb_distances_of(recording.orb), np.random.default_rng(1))
        report("network", recording, distances_of(network, recording.patches), np.random.default_rng(1))


if __name__ == "__main__":
    main()

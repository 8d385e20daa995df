#!/usr/bin/python3
"""Trains the network that describes places, and writes it as ONNX.

Recordings are "KIND PATH" or "KIND PATH+PATH" as in views.py, for instance "world city_50+city_50_dark". Two views of one
recording are positives if they share enough surface, negatives if they share none, whatever their angle and light; views of
different recordings are negatives. The loss is that of supervised contrastive learning (Khosla et al., NeurIPS 2020, Eq. 2).
"""
import argparse
import pathlib
import time

import numpy as np
import onnx
import torch
import torch.nn.functional as F
from onnx import numpy_helper
from PIL import Image
from torch import nn

import training
import views
from views import OTHER, SAME

SIZE = (160, 120)  # width, height of the input [px]
DIMENSIONS = 128
SHRINKAGE = 0.1  # of the covariance inside places towards a multiple of the identity


def layer(inputs, outputs, stride):
    return nn.Sequential(nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU())


class PlaceNetwork(nn.Module):
    """Grey image (1 x 120 x 160, mean 0, deviation 1) to 128 numbers, compared by their cosine."""

    def __init__(self):
        super().__init__()
        self.layers = nn.Sequential(layer(1, 16, 2), layer(16, 32, 2), layer(32, 32, 1), layer(32, 64, 2),
                                    layer(64, 64, 1), layer(64, 128, 2), layer(128, 128, 1))
        self.average, self.maximum = nn.AdaptiveAvgPool2d(1), nn.AdaptiveMaxPool2d(1)
        self.linear = nn.Linear(256, DIMENSIONS)

    def pooled(self, images):
        maps = self.layers(images)
        return torch.cat([self.average(maps), self.maximum(maps)], 1).flatten(1)

    def forward(self, images):
        return self.linear(self.pooled(images))

    def load(self, path):
        """Takes the numbers of a file by export(), where the normalisation is part of the convolutions."""
        graph = onnx.load(str(path)).graph
        arrays = {x.name: torch.tensor(numpy_helper.to_array(x)) for x in graph.initializer}
        nodes = [node for node in graph.node if node.op_type == "Conv"]
        with torch.no_grad():
            for (convolution, norm, _), node in zip(self.layers, nodes):
                convolution.weight.copy_(arrays[node.input[1]])
                norm.bias.copy_(arrays[node.input[2]])
            self.linear.weight.copy_(arrays["linear.weight"])
            self.linear.bias.copy_(arrays["linear.bias"])


def normalized(images):
    """Mean 0 and deviation 1 of each image, as image_describer.hpp does it."""
    centered = images - images.mean((1, 2, 3), keepdim=True)
    return centered / centered.pow(2).mean((1, 2, 3), keepdim=True).sqrt().clamp(min=1e-3)


def augmented(images, random):
    """The images in other light, slightly moved, blurred, with noise, partly hidden; all mirrored or none."""
    n = len(images)
    uniform = lambda low, high, *shape: torch.tensor(random.uniform(low, high, (n, *shape)), dtype=torch.float32)
    angle, zoom = uniform(-0.17, 0.17), uniform(0.75, 1.1)
    cosine, sine = zoom * angle.cos(), zoom * angle.sin()
    mirror = 1.0 if random.random() < 0.5 else -1.0
    affine = torch.stack([torch.stack([mirror * cosine, -sine, uniform(-0.15, 0.15)], 1),
                          torch.stack([mirror * sine, cosine, uniform(-0.1, 0.1)], 1)], 1)
    grid = F.affine_grid(affine, images.shape, align_corners=False)
    images = F.grid_sample(images, grid, padding_mode="reflection", align_corners=False)
    images = images.clamp(0, 1) ** torch.exp(uniform(-0.7, 0.7, 1, 1, 1))
    slope = torch.linspace(-1, 1, SIZE[0]) * uniform(-0.4, 0.4, 1, 1, 1)
    images = images * uniform(0.4, 1.6, 1, 1, 1) * (1 + slope)
    soft = F.avg_pool2d(images, 3, 1, 1)
    share = uniform(-1, 1, 1, 1, 1).clamp(min=0)
    images = (images + share * (soft - images)).clamp(0, 1)
    images = images + torch.randn(images.shape) * uniform(0, 0.04, 1, 1, 1)
    for i in np.flatnonzero(random.random(n) < 0.3):
        w, h = random.integers(15, 60), random.integers(15, 50)
        x, y = random.integers(0, SIZE[0] - w), random.integers(0, SIZE[1] - h)
        images[i, :, y:y + h, x:x + w] = random.random()
    return normalized(images)


class Place:
    """The images of a recording, and who shares surface with whom."""

    def __init__(self, recording, cache):
        file = cache / (recording.replace("/", "_").replace(" ", "_") + ".npz")
        if not file.exists():
            found = views.read_views(recording)
            images = [np.asarray(Image.open(view.image).convert("L").resize(SIZE, Image.BOX)) for view in found]
            np.savez_compressed(file, images=np.array(images), overlaps=views.overlaps(found),
                                angles=views.angles_deg(found))
        data = np.load(file)
        self.images, self.overlaps, angles = data["images"], data["overlaps"], data["angles"]
        # Pairs of large angles are rare: a pair of each bin is equally likely.
        bins = np.digitize(angles, [10, 30, 60, 90])
        pairs = [np.argwhere((self.overlaps > SAME) & (bins == b) & ~np.eye(len(angles), dtype=bool)) for b in range(5)]
        self.pairs = [found for found in pairs if len(found) > 10]

    def sample(self, count, random):
        chosen = [found[random.integers(len(found))] for found in
                  (self.pairs[random.integers(len(self.pairs))] for _ in range(count))]
        return np.concatenate(chosen)


def batch_of(places, count, random):
    """Images of `count` pairs from four places, and the matrix of their overlaps."""
    images, blocks = [], []
    for index in random.choice(len(places), 4, replace=False):
        rows = places[index].sample(count // 4, random)
        images.append(places[index].images[rows])
        blocks.append(torch.tensor(places[index].overlaps[np.ix_(rows, rows)]))
    pixels = torch.tensor(np.concatenate(images), dtype=torch.float32)[:, None] / 255
    return pixels, torch.block_diag(*blocks)


def contrastive_loss(descriptors, overlaps, temperature):
    z = F.normalize(descriptors, dim=1)
    logits = z @ z.T / temperature
    itself = torch.eye(len(z), dtype=torch.bool)
    positive = (overlaps > SAME) & ~itself
    compared = (positive | (overlaps < OTHER)) & ~itself
    logarithms = logits - torch.logsumexp(logits.masked_fill(~compared, -1e9), 1, keepdim=True)
    return -((logarithms * positive).sum(1) / positive.sum(1).clamp(min=1)).mean()


def fit_last_layer(network, places, random, pairs=200):
    """Linear discriminant analysis of the pooled numbers, the last layer in closed form: views of one place become similar,
    and the places of one world different (compare the learned whitening of Radenovic et al., TPAMI 2019, Sec. 3.3)."""
    network.eval()
    differences, deviations, means = [], [], []
    with torch.no_grad():
        for place in places:
            images = torch.tensor(place.images[place.sample(pairs, random)], dtype=torch.float32)[:, None] / 255
            numbers = network.pooled(augmented(images, random))
            differences.append((numbers[0::2] - numbers[1::2]) / 2**0.5)
            means.append(numbers.mean(0))
            deviations.append(numbers - means[-1])
        inside = torch.cat(differences).T.cov().double()
        inside += SHRINKAGE * inside.trace() / len(inside) * torch.eye(len(inside))
        values, vectors = torch.linalg.eigh(inside)
        whitening = vectors @ torch.diag(values.rsqrt()) @ vectors.T
        _, axes = torch.linalg.eigh(whitening @ torch.cat(deviations).T.cov().double() @ whitening)
        weight = (axes[:, -DIMENSIONS:].T @ whitening).float()
        network.linear.weight.copy_(weight)
        network.linear.bias.copy_(-weight @ torch.stack(means).mean(0))


def export(network, path):
    network.eval()
    torch.onnx.export(network, torch.zeros(1, 1, SIZE[1], SIZE[0]), path, opset_version=11,
                      input_names=["image"], output_names=["descriptor"])


def known_values(network):
    """The first bytes of a descriptor, for the test of the shipped network (test_image_describer.cpp)."""
    x, y = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    image = torch.tensor((x * x // 40 + 3 * y) % 256, dtype=torch.float32)[None, None]
    with torch.no_grad():
        values = network(normalized(image))[0]
    return torch.round(127 * values / values.abs().max()).int().tolist()[:16]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", nargs="+", help="at least four")
    training.define_options(parser, steps=600)
    parser.add_argument("--start", type=pathlib.Path,
                        help="begin with this file; with --steps 0 only the last layer is fitted")
    parser.add_argument("--pairs", type=int, default=48, help="pairs in a batch")
    options = parser.parse_args()
    random = training.prepare(options)
    places = [Place(recording, options.cache) for recording in options.recordings]
    places = [place for place in places if place.pairs]
    print(len(places), "places,", sum(len(place.images) for place in places), "images", flush=True)
    network = PlaceNetwork()
    if options.start:
        network.load(options.start)

    def loss_of_batch():
        images, overlaps = batch_of(places, options.pairs, random)
        return contrastive_loss(network(augmented(images, random)), overlaps, 0.1)

    for step, loss in training.optimized(network, options, 2e-3, loss_of_batch):
        if step % 50 == 0:
            print(f"{step} steps, {time.process_time():.0f} s of a core, loss {loss:.3f}", flush=True)
            export(network, options.output)
            network.train()
    fit_last_layer(network, places, random)
    export(network, options.output)
    print("known values:", known_values(network))
    print(sum(p.numel() for p in network.parameters()), "parameters,", options.output.stat().st_size, "bytes")


if __name__ == "__main__":
    main()

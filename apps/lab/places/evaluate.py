#!/usr/bin/python3
"""Recall and precision of words and of a network, by the angle between views.

The views of each robot are queries among those of all others; a recording of one robot is cut in two. A pair shows one
place if the views share a quarter of the surface or more, and two places if they share less than 4 %; other pairs do not
count. Words are compared as robots do it: by their score over that of the query and the view before it. Recordings are
those of views.py: with "world a+b", b in another light, only the pairs between a and b count.
"""
import argparse
import pathlib
import subprocess
import tempfile

import numpy as np

import views
from views import OTHER, SAME

BINS = ((0, 30), (30, 60), (60, 90), (90, 180))
CANDIDATES = 5  # per query, as place_recognition.max_candidates


def run_program(options, arguments, images):
    """Lines of the file that kimera_multi_vocabulary writes for the images."""
    with tempfile.TemporaryDirectory() as folder:
        listing, output = pathlib.Path(folder) / "images.txt", pathlib.Path(folder) / "output"
        listing.write_text("".join(f"{image.resolve()}\n" for image in images))
        program = options.programs / "kimera_multi_vocabulary"
        done = subprocess.run([program, *arguments, listing, "-o", output], check=True, capture_output=True, text=True)
        return output.read_text().splitlines(), done.stdout.strip()


def word_vectors(options, images):
    """TF-IDF vectors of L1 norm 1, one row per image."""
    lines, _ = run_program(options, ["bags", options.vocabulary], images)
    content = pathlib.Path(options.vocabulary).read_bytes()
    idf = np.frombuffer(content[-4 * int.from_bytes(content[24:28], "little"):], "<f4")
    vectors = np.zeros((len(images), len(idf)), np.float32)
    for row, line in zip(vectors, lines):
        for word, count in (entry.split(":") for entry in line.split()):
            row[int(word)] = float(count) * idf[int(word)]
    return vectors / np.maximum(vectors.sum(1, keepdims=True), 1e-9)


def word_similarities(vectors, groups):
    """Score of each pair over that of the query and the view before it; 0 without one."""
    n = len(vectors)
    similarities = np.zeros((n, n), np.float32)
    for i in range(1, n):
        normalizer = np.minimum(vectors[i], vectors[i - 1]).sum()
        if groups[i] == groups[i - 1] and normalizer >= 0.05:
            similarities[i] = np.minimum(vectors, vectors[i]).sum(1) / normalizer
    return similarities


def network_similarities(options, images):
    lines, summary = run_program(options, ["describe", options.network], images)
    print(summary)
    width = max(len(line.split()) for line in lines)
    rows = np.array([[float(x) for x in line.split()] or [0.0] * width for line in lines])
    rows /= np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-9)
    return rows @ rows.T


def best_candidates(similarities, compared, threshold):
    """The most similar views of each query at or above the threshold, as a mask."""
    values = np.where(compared & (similarities >= threshold), similarities, -np.inf)
    ranks = (-values).argsort(1, kind="stable").argsort(1)
    return (ranks < CANDIDATES) & np.isfinite(values)


def percent(part, whole):
    return f"{100 * part / whole:.0f} %" if whole else "-"


class Judged:
    """The pairs of a recording that are compared, and what they show."""

    def __init__(self, recording):
        kind, paths = recording.split(" ", 1)
        lights = [views.read_views(f"{kind} {path}") for path in paths.split("+")]
        self.views = [view for found in lights for view in found]
        light = np.repeat(np.arange(len(lights)), [len(found) for found in lights])
        half = np.arange(len(self.views)) * 2 // len(self.views)
        robots = [view.robot or str(part) for view, part in zip(self.views, half)]
        self.groups = np.array([f"{robot} {number}" for robot, number in zip(robots, light)])
        parts = light if len(lights) > 1 else self.groups
        self.compared = parts[:, None] != parts[None]
        shares, self.angles = views.overlaps(self.views), views.angles_deg(self.views)
        self.same = self.compared & (shares > SAME)
        self.counted = self.same | self.compared & (shares < OTHER)

    def recall(self, found, inside=True):
        return percent((found & self.same & inside).sum(), (self.same & inside).sum())

    def precision(self, found, inside=True):
        return percent((found & self.same & inside).sum(), (found & self.counted & inside).sum())


def print_angles(judged, methods):
    masks = [(judged.angles >= low) & (judged.angles < high) for low, high in BINS] + [True]
    print("\n| recall / precision | " + " | ".join(f"{a} to {b} deg" for a, b in BINS) + " | all |")
    print("|---" * 6 + "|")
    print("| pairs of one place | " + " | ".join(str((judged.same & mask).sum()) for mask in masks) + " |")
    for name, found in methods.items():
        print(f"| {name} | " + " | ".join(f"{judged.recall(found, mask)} / {judged.precision(found, mask)}"
                                          for mask in masks) + " |")


def print_candidates(judged, options, words, network):
    """The best candidates of a query, where those of the network come after those of words."""
    by_words = best_candidates(words, judged.compared, options.word_threshold)
    by_network = best_candidates(network, judged.compared, options.threshold)
    order = np.where(by_words, 10 + words, network)
    both = best_candidates(order, judged.compared, options.threshold)
    queries = judged.same.any(1)
    print("\n| candidates of a query | queries with a right one | candidates | of one place |\n" + "|---" * 4 + "|")
    for name, found in (("words", by_words), ("network", by_network), ("words, then network", both)):
        right = (found & judged.same).any(1)[queries].sum()
        print(f"| {name} | {percent(right, queries.sum())} | {found.sum()} | {judged.precision(found)} |")


def evaluate(options, recording):
    judged = Judged(recording)
    images = [view.image for view in judged.views]
    words = word_similarities(word_vectors(options, images), judged.groups)
    network = network_similarities(options, images)
    same, counted = judged.same.sum(), judged.counted.sum()
    print(f"\n{recording}: {len(images)} views, {same} pairs of one place, {counted - same} of two")
    by_words, by_network = words >= options.word_threshold, network >= options.threshold
    print_angles(judged, {"words": by_words, "network": by_network, "either": by_words | by_network})
    print_candidates(judged, options, words, network)
    print("\n| threshold of the network | recall | precision |\n|---|---|---|")
    for threshold in np.arange(0.1, 0.61, 0.05):
        print(f"| {threshold:.2f} | {judged.recall(network >= threshold)} | {judged.precision(network >= threshold)} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("network", help="ONNX file")
    parser.add_argument("recordings", nargs="+", help='"KIND PATH" or "world PATH+PATH"')
    parser.add_argument("--vocabulary", default="config/vocabulary/indoor.kmvoc")
    parser.add_argument("--programs", type=pathlib.Path, default=pathlib.Path("build/bin"))
    parser.add_argument("--threshold", type=float, default=0.35, help="as place_recognition.image_similarity")
    parser.add_argument("--word-threshold", type=float, default=0.5)
    options = parser.parse_args()
    for recording in options.recordings:
        evaluate(options, recording)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Turns the result files of the paper's experiments into its tables and figures.

  tables.py tables --data DATA --output OUTPUT [--quick]   writes OUTPUT/report.md and its figures
  tables.py stamps RUN POSES OUTPUT                        solved poses as a trajectory of each robot
  tables.py placed RUN OUTPUT                              odometry in the frame of the team
  tables.py joined TEAM_JSON                               exit code 0 if all robots joined

The Makefile beside it makes the result files, and calls all of these. The results of a team are
OUTPUT/team-RUN.json and the folder DATA/RUN_res. RUN is a world, WORLD-runN, WORLD-seedN, WORLD-paper
or levelN-WORLD-seedN.
"""

import argparse
import bisect
import csv
import glob
import gzip
import json
import math
import os
import re
import statistics
import sys

# What the sections are of: names of files, and titles for people.
WORLDS = {"city": "City", "camp": "Camp", "v1": "Vicon Room 1", "v2": "Vicon Room 2"}
METHODS = {"local": "Local PGO", "rbcd": "RBCD", "rbcd50": "RBCD, 50 rounds",
           "centralized": "Centralised", "newton": "Newton, the default"}
LEVEL_WORLDS = {"vicon_room": ("Vicon room", ""), "city": ("City", ""), "camp": ("Camp", ""),
                "vicon_room_long": ("Vicon room, 5 minutes", "long"),
                "city_long": ("City, 10 minutes", "long"),
                "camp_long": ("Camp, 10 minutes", "long")}
COSMO = {"kth_r3_00_d06_d09_d10_wifi": "kth_r3_00, Wi-Fi",
         "kth_r3_00_d06_d09_d10_proradio": "kth_r3_00, Pro-Radio",
         "ntu_r3_02_d02_n04_n13_wifi": "ntu_r3_02, Wi-Fi",
         "ntu_r3_02_d02_n04_n13_proradio": "ntu_r3_02, Pro-Radio"}

# Chang, Tian, How and Carlone, "Kimera-Multi: a System for Distributed Multi-Robot Metric-Semantic
# Simultaneous Localization and Mapping", ICRA 2021. Table I, in the order local PGO, RBCD, RBCD
# stopped after 50 rounds, SE-Sync. Table II: keypoints and images are those of a centralised
# system.
PAPER_COLUMNS = ("local", "rbcd", "rbcd50", "centralized")
PAPER_ATE_M = {"city": (6.09, 2.38, 2.88, 1.46), "camp": (2.81, 2.28, 2.52, 2.28),
               "v1": (0.455, 0.317, 0.348, 0.308), "v2": (0.473, 0.453, 0.413, 0.453)}
PAPER_COST = {"city": (168532, 1113.1, 3192.9, 1047.3),
              "camp": (96695, 140.45, 140.97, 140.32),
              "v1": (6451.9, 96.97, 138.18, 90.61),
              "v2": (432.42, 5.44, 7.19, 5.15)}
RESOURCES = ("poses", "edges", "places", "verification", "pgo", "total", "images", "keypoints",
             "rbcd_rounds", "rbcd_s", "rbcd50_s", "se_sync_s")
PAPER_RESOURCES = {
    world: {**dict(zip(RESOURCES, row)), "percent": 100.0 * row[5] / row[7]} for world, row in {
        "city": (3238, 3428, 16.43, 36.80, 4.27, 57.50, 1989.4, 149.48, 500, 34.90, 2.76, 2.23),
        "camp": (5189, 5411, 40.01, 9.59, 1.17, 50.77, 3188.1, 242.66, 128, 33.16, 6.49, 4.34),
        "v1": (1690, 1730, 9.52, 7.32, 0.16, 17.00, 1223.9, 73.76, 95, 3.02, 1.53, 0.33),
        "v2": (1526, 1544, 8.95, 8.63, 0.20, 17.78, 1105.1, 69.35, 173, 5.84, 1.72, 0.47)}.items()}
# Table III: right labels before and after the correction [%], of robots 0 to 2 and of all together.
PAPER_LABELS = {"city": ((85.52, 88.52, 85.74, 67.91), (85.52, 85.65, 90.31, 83.93)),
                "camp": ((95.83, 96.65, 95.28, 94.22), (94.67, 97.92, 95.42, 95.13))}
PAPER_MOST_SHARE_PERCENT = 38.0  # of the bytes of all keypoints, Table II
PAPER_MOST_RBCD_GAP_PERCENT = 7.0
# Absolute trajectory errors of Kimera-VIO [m]: Rosinol et al., "Kimera: an Open-Source Library for
# Real-Time Metric-Semantic Localization and Mapping", ICRA 2020.
PUBLISHED_ODOMETRY_M = {"V1_01": 0.08, "V1_02": 0.11, "V1_03": 0.12,
                        "V2_01": 0.07, "V2_02": 0.10, "V2_03": 0.19}
# RMSE of all robots under one alignment [m], in the tables of UMich-RobotExploration/
# variable-projection (examples/data/analysis/): variants of IRLS-GNC, and GTSAM's GNC-GM.
PUBLISHED_COSMO_M = {"kth_r3_00_d06_d09_d10_wifi": ((1.77,), (1.79,)),
                     "kth_r3_00_d06_d09_d10_proradio": ((1.10, 1.11), ()),
                     "ntu_r3_02_d02_n04_n13_wifi": ((2.70, 6.33, 147.0), (2.31,)),
                     "ntu_r3_02_d02_n04_n13_proradio": ((3.32, 3.44, 112.0), ())}

# The bytes of a team are compared with those that the server of a centralised system would receive:
# each keyframe once, with 8 bytes of position and 32 of descriptor for each keypoint.
KEYPOINT_BYTES = 40.0
PACKED_KEYPOINT_BYTES = 16.6  # as robots pack a keypoint with its descriptor
BYTES_PER_PIXEL = 2.0  # two cameras with one byte per pixel, as in the paper's numbers
FINISHED_GAP = 1e-6    # a method is finished when its cost is within this share of its last

NAN = math.nan


# ---------------------------------------------------------------------------- files

def open_text(path):
    return gzip.open(path, "rt") if path.endswith(".gz") else open(path, encoding="utf-8")


def read_json(path):
    with open(path, encoding="utf-8") as file:
        try:
            return json.load(file)
        except ValueError as error:
            raise SystemExit(f"{path}: not JSON ({error})")


def number(tree, *keys):
    """The number at a place in a tree of JSON; None if it is absent or null."""
    for key in keys:
        if not isinstance(tree, dict) or key not in tree:
            return None
        tree = tree[key]
    return float(tree) if isinstance(tree, (int, float)) and not isinstance(tree, bool) else None


def named(tree, name, *keys):
    """The entry with this name in a list of objects; empty if there is none."""
    for key in keys:
        tree = tree.get(key) or {}
    return next((entry for entry in tree or [] if entry.get("name") == name), {})


def read_trajectory(path):
    """Rows (stamp [ns], position, quaternion x y z w): EuRoC's CSV has commas, TUM's text blanks."""
    rows = []
    with open_text(path) as file:
        for line in file:
            line = line.split("#")[0].strip()
            if not line or line[0].isalpha():
                continue
            if "," in line:
                stamp, x, y, z, qw, qx, qy, qz = line.split(",")[:8]
                stamp = int(stamp)
            else:
                stamp, x, y, z, qx, qy, qz, qw = line.split()[:8]
                stamp = nanoseconds(stamp)
            if not rows or rows[-1][0] != stamp:  # of equal stamps the first counts
                rows.append((stamp, (float(x), float(y), float(z)),
                             (float(qx), float(qy), float(qz), float(qw))))
    if not rows:
        raise SystemExit(f"{path}: holds no pose")
    return rows


def nanoseconds(seconds):
    """Stamp of a text of seconds, without the rounding of a double."""
    whole, _, part = seconds.partition(".")
    return int(whole) * 10**9 + int((part + "0" * 9)[:9])


def tum_row(stamp_ns, rest):
    return f"{stamp_ns // 10**9}.{stamp_ns % 10**9:09d} {rest}\n"


def robots_of(run):
    """Names of the robots of a run's folder, in the order of their ids."""
    files = glob.glob(os.path.join(run, "*", "summary.json"))
    if not files:
        raise SystemExit(f"{run}: no summary.json of a robot")
    return [name for _, name in sorted((int(read_json(file).get("robot", 0)),
                                        os.path.basename(os.path.dirname(file)))
                                       for file in files)]


# ---------------------------------------------------------------------------- trajectories

def write_stamped(run, poses, output):
    """Solved poses are numbered robot by robot: writes those of each with the stamps of its
    keyframes."""
    with open(poses, encoding="utf-8") as file:
        rows = [line.split(maxsplit=1)[1].strip() for line in file if not line.startswith("#")]
    stamps = {}
    for robot in robots_of(run):
        with open(os.path.join(run, robot, "keyframes.csv"), encoding="utf-8") as file:
            stamps[robot] = [int(row["stamp_ns"]) for row in csv.DictReader(file)]
    count = sum(map(len, stamps.values()))
    if count != len(rows):
        raise SystemExit(f"{run}: its robots have {count} keyframes, {poses} has {len(rows)} poses")
    os.makedirs(output, exist_ok=True)
    for robot, own in stamps.items():
        with open(os.path.join(output, robot + ".tum"), "w", encoding="utf-8") as file:
            file.writelines(tum_row(stamp, rows.pop(0)) for stamp in own)


def product(a, b):
    """Of two quaternions x y z w."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)


def conjugate(q):
    return (-q[0], -q[1], -q[2], q[3])


def rotated(q, p):
    return product(product(q, (*p, 0.0)), conjugate(q))[:3]


def write_placed(run, output):
    """Moves the odometry of each robot so that its pose at the first optimised keyframe is that
    keyframe's."""
    os.makedirs(output, exist_ok=True)
    for robot in robots_of(run):
        folder = os.path.join(run, robot)
        odometry = read_trajectory(os.path.join(folder, "odometry.tum"))
        stamp, t_team, q_team = read_trajectory(os.path.join(folder, "optimized_keyframes.tum"))[0]
        stamps = [row[0] for row in odometry]
        at = bisect.bisect_left(stamps, stamp)
        nearest = min(odometry[max(at - 1, 0):at + 1], key=lambda row: abs(row[0] - stamp))
        if abs(nearest[0] - stamp) > 10**7:
            raise SystemExit(f"{folder}: no odometry at its first keyframe")
        q = product(q_team, conjugate(nearest[2]))  # from the frame of odometry to the team's
        moved = rotated(q, nearest[1])
        t = [a - b for a, b in zip(t_team, moved)]
        with open(os.path.join(output, robot + ".tum"), "w", encoding="utf-8") as file:
            for stamp, position, rotation in odometry:
                place = [a + b for a, b in zip(t, rotated(q, position))]
                values = (*place, *product(q, rotation))
                file.write(tum_row(stamp, " ".join(format(value, ".17g") for value in values)))


def all_joined(team):
    return bool(team["robots"]) and all(robot.get("in_team_frame", True) for robot in team["robots"])


# ---------------------------------------------------------------------------- results

def scaled(value, factor):
    return None if value is None else factor * value


class Mesh:
    """Errors [cm] and right labels [%] of a mesh. Error: from every true point within reach, as the
    paper measures it; seen: without true surface that no robot can have seen; back: from every
    point of the mesh to the true one."""

    def __init__(self, tree):
        self.error = scaled(number(tree, "truth_to_estimate", "point", "mean_m"), 100.0)
        self.seen = scaled(number(tree, "seen_truth_to_estimate", "point", "mean_m"), 100.0)
        self.back = scaled(number(tree, "estimate_to_truth", "point", "mean_m"), 100.0)
        self.labels = scaled(number(tree, "truth_to_estimate", "labels", "accuracy"), 100.0)
        self.seen_labels = scaled(number(tree, "seen_truth_to_estimate", "labels", "accuracy"), 100.0)


class Process:
    """Processor time, memory and modules of a robot's process."""

    def __init__(self, folder):
        self.summary = read_json(os.path.join(folder, "summary.json"))
        self.name = self.summary.get("name", "")
        with open(os.path.join(folder, "timing.csv"), encoding="utf-8") as file:
            self.module_s = {row["module"]: float(row["total_s"]) for row in csv.DictReader(file)}
        self.processor_s = number(self.summary, "process", "cpu_s")
        self.memory_mb = scaled(number(self.summary, "process", "peak_memory_bytes"), 1e-6)
        self.recorded_s = 0.0

    def cores(self):
        known = self.processor_s is not None and self.recorded_s > 0.0
        return self.processor_s / self.recorded_s if known else None

    def share_percent(self, module):
        total = sum(self.module_s.values())
        return 100.0 * self.module_s.get(module, 0.0) / total if total > 0.0 else 0.0


class Robot(Process):
    def __init__(self, name, team, run, truth):
        super().__init__(os.path.join(run, name))
        own = named(team, name, "robots")
        self.name = name
        self.distance_m = 0.0
        if truth:
            poses = read_trajectory(truth)
            self.distance_m = sum(math.dist(a[1], b[1]) for a, b in zip(poses, poses[1:]))
            self.recorded_s = 1e-9 * (poses[-1][0] - poses[0][0])
        self.joined = own.get("in_team_frame", True)
        self.odometry_m = number(own, "odometry", "position_m", "rmse")
        self.optimized_m = number(named(team, name, "optimized", "robots"), "position_m", "rmse")
        self.sent = self.summary.get("traffic", {})
        self.keyframes = int(number(self.summary, "keyframes") or 0)
        self.keypoints = number(self.summary, "keypoints") or 0.0
        self.peer_keyframes = number(self.summary, "peer_keyframes", "keyframes") or 0.0
        self.peer_keypoints = number(self.summary, "peer_keyframes", "keypoints") or 0.0
        self.divergences = number(self.summary, "odometry", "divergences") or 0.0
        self.before = Mesh(named(team, name, "meshes", "robots"))
        self.after = Mesh(named(team, name, "optimized_meshes", "robots"))

    def drift_percent(self):
        if self.odometry_m is None or not self.distance_m > 0.0:
            return None
        return 100.0 * self.odometry_m / self.distance_m


class Solution:
    """Result of an optimisation method on a team's graph; NaN, shown as "-", without one. The method
    is finished in the first round whose cost is within FINISHED_GAP of its last. A method that
    rejects closures is finished when it has decided, and has no cost here."""

    def __init__(self, tree, ate):
        self.edges, self.cost, self.optimum = (
            or_nan(number(tree, key)) for key in ("edges", "rounded_cost", "optimum"))
        self.error_m = or_nan(number(ate, "joint", "position_m", "rmse"))
        rounds = tree.get("rounds") or [{}]
        limit = (1.0 + FINISHED_GAP) * (number(rounds[-1], "cost") or 0.0)
        last = rounds[-1] if "decided" in tree else next(
            (entry for entry in rounds if (number(entry, "cost") or 0.0) <= limit), rounds[-1])
        self.rounds, self.bytes, self.seconds = (
            or_nan(number(last, key)) for key in ("round", "bytes", "critical_path_s"))
        # Rounding moves the cost of the optimum itself slightly below or above.
        gap = 100.0 * (self.cost / self.optimum - 1.0)
        self.gap_percent = 0.0 if gap < 0.0 else gap


class Run:
    """Results of a team in a world. Sizes are in megabytes."""

    def __init__(self, name, title, results):
        self.name, self.title, self.results = name, title, results
        team = results.json(f"team-{name}.json")
        world = re.sub(r"-(run\d+|paper)$", "", name)
        recordings = os.path.join(results.data, world)
        original = results.has(f"teams/{world}.yaml")  # EuRoC's own images
        truths = self.truths_of(results.file(f"teams/{world}.yaml") if original
                                else os.path.join(recordings, "team.yaml"))
        folder = os.path.join(results.data, name + ("_euroc_res" if original else "_res"))
        self.robots = [Robot(robot["name"], team, folder, truths.get(robot["name"]))
                       for robot in team["robots"]]
        self.joined = sum(robot.joined for robot in self.robots)
        self.joint_m = or_nan(number(team, "optimized", "joint", "position_m", "rmse"))
        self.live_m = or_nan(number(team, "live", "joint", "position_m", "rmse"))
        self.odometry_m = statistics.fmean(or_nan(robot.odometry_m) for robot in self.robots)
        self.before = Mesh((team.get("meshes") or {}).get("merged") or {})
        self.after = Mesh((team.get("optimized_meshes") or {}).get("merged") or {})
        self.meshes = [(robot.name, robot.before, robot.after) for robot in self.robots] + [
            ("merged", self.before, self.after)]
        self.closures = number(team, "closures", "inliers", "judged")
        self.true_closures = number(team, "closures", "inliers", "correct")
        self.by_angle = (team.get("closures") or {}).get("by_angle", [])
        self.solutions = {method: Solution(*(results.json(f"{kind}-{name}-{method}.json")
                                             for kind in ("pgo", "ate"))) for method in METHODS}
        self.images, pixels = "EuRoC's images, 752x480", 752 * 480
        if not original:
            made = read_json(os.path.join(recordings, "simulation.json"))["parameters"]
            resolution = made.get("resolution", "752x480")
            pixels = math.prod(map(int, resolution.split("x")))
            self.images = f"{resolution}, {made.get('rig', 'stereo')}, seed {made.get('seed', '?')}"
        self.count_bytes(pixels)

    def count_bytes(self, pixels):
        """Counted as in the paper, one solve of the final graph; and as the team sent them."""
        sent = lambda category: 1e-6 * sum(robot.sent.get(category, 0) for robot in self.robots)
        self.keyframes = sum(robot.keyframes for robot in self.robots)
        self.places, self.verification = sent("place_recognition"), sent("geometric_verification")
        self.live_pgo = sent("pgo")
        self.pgo, self.newton = (1e-6 * self.solutions[key].bytes for key in ("rbcd", "newton"))
        self.total = self.places + self.verification + self.pgo
        self.images_mb = 1e-6 * BYTES_PER_PIXEL * pixels * self.keyframes
        self.keypoints = 1e-6 * KEYPOINT_BYTES * sum(
            robot.keypoints for robot in self.robots if robot.keyframes > 0)
        self.total_percent, self.run_percent = (
            100.0 * divided(self.places + self.verification + pgo, self.keypoints)
            for pgo in (self.pgo, self.live_pgo))
        # Keypoints do not show the map, so it is not counted.
        self.all_sent = 1e-6 * sum(size for robot in self.robots
                                   for category, size in robot.sent.items() if category != "map")
        received, keypoints = (sum(getattr(robot, name) for robot in self.robots)
                               for name in ("peer_keyframes", "peer_keypoints"))
        self.equal_percent = equal_percent(1e6 * self.all_sent, self.keyframes, received, keypoints)

    @staticmethod
    def truths_of(team_file):
        """True poses of each robot, from a team file as the simulator and the Makefile write it."""
        truths, name = {}, None
        with open(team_file, encoding="utf-8") as file:
            for key, value in re.findall(r"\b(name|truth): *\"?([^\",}\n]+)", file.read()):
                if key == "name":
                    name = value
                else:
                    truths[name] = os.path.join(os.path.dirname(team_file), value)
        return truths


class Results:
    """All results that exist. Each run is read once."""

    def __init__(self, data, output, quick):
        self.data, self.output, self.quick = data, output, quick
        self.targets, self.runs = [], {}

    def file(self, name):
        return os.path.join(self.output, name)

    def has(self, name):
        return os.path.exists(self.file(name))

    def json(self, name):
        return read_json(self.file(name)) if self.has(name) else {}

    def matches(self, pattern):
        """Matches of a pattern with the names of files."""
        names = (os.path.basename(path) for path in glob.glob(self.file("*.json")))
        return [match for match in (re.fullmatch(pattern, name) for name in names) if match]

    def run(self, name, title):
        """None without a result."""
        if name not in self.runs:
            self.runs[name] = Run(name, title, self) if self.has(f"team-{name}.json") else None
        return self.runs[name]

    def worlds(self):
        return [run for run in (self.run(*world) for world in WORLDS.items()) if run]

    def runs_of(self, world):
        """The run of a world and its repetitions, by kind and number."""
        found = self.matches(rf"team-({world.name}-(run|seed)(\d+))\.json")
        return [world] + [self.run(match[1], world.title)
                          for match in sorted(found, key=lambda match: (match[2], int(match[3])))]

    def target(self, what, where, wanted, measured, met, full_size=True):
        """A number to reach. Small versions of the experiments cannot decide those of full size."""
        verdict = "Not judged" if self.quick and full_size else "Met" if met else "Missed"
        self.targets.append((verdict, what, where, wanted, measured))


# ---------------------------------------------------------------------------- texts

def or_nan(value):
    return NAN if value is None else value


def divided(a, b):
    return a / b if b else NAN


def equal_percent(sent, keyframes, received, keypoints):
    """The bytes `sent`, without the map, as a share of those of a server [%]. It receives each of the
    team's keyframes with as many keypoints as the robots have of those they received, packed equally."""
    return 100.0 * divided(sent, PACKED_KEYPOINT_BYTES * keyframes * divided(keypoints, received))


def fixed(value, decimals):
    return f"{value:.{decimals}f}" if value is not None and math.isfinite(value) else "-"


def significant(value, digits=3):
    """So many significant digits, without exponent from 1e-5 on."""
    if not math.isfinite(value) or abs(value) < 1e-5:
        return "-" if not math.isfinite(value) else "0" if abs(value) < 1e-12 else "< 0.00001"
    return fixed(value, max(0, digits - 1 - math.floor(math.log10(abs(value)))))


class Spread:
    """Median, lowest and highest of the finite values."""

    def __init__(self, values):
        values = [value for value in values if value is not None and math.isfinite(value)]
        self.count = len(values)
        self.median = statistics.median(values) if values else 0.0
        self.lowest, self.highest = (min(values), max(values)) if values else (0.0, 0.0)

    def range(self, decimals):
        return f"{fixed(self.lowest, decimals)} to {fixed(self.highest, decimals)}"

    def cell(self, decimals):
        if self.count == 0:
            return "-"
        return beside(fixed(self.median, decimals), self.range(decimals) if self.count > 1 else "")

    def range_text(self, decimals):
        """To follow the median; empty for a single value."""
        return f" ({self.range(decimals)} in {self.count} runs)" if self.count > 1 else ""


def beside(ours, paper):
    """Our value, and the paper's in brackets."""
    return f"{ours} ({paper})" if paper else ours


def strong(text):
    return f"**{text}**" if text else text


def title_of(subject):
    return subject.title


def table(caption, columns, subjects, note="", words=False):
    """`columns`: heading and cell of a subject; a row for each subject."""
    if not subjects:
        return ""
    rows = [[cell(subject).replace("|", "\\|") for cell in columns.values()] for subject in subjects]
    aligned = ["---" if words or c == 0 else "---:" for c in range(len(columns))]
    lines = ["| " + " | ".join(row) + " |" for row in [list(columns), aligned, *rows]]
    return f"**{caption}**\n\n" + "\n".join(lines) + "\n\n" + (note + "\n\n" if note else "")


# ---------------------------------------------------------------------------- figures

COLOURS = ("#1f5fa8", "#c8502a", "#3a8a4d")


def write_chart(path, title, series, names=(), log=False):
    """Lines with a band: {name: [(x, y, lowest, highest), ...]}. With the names of groups: bars
    {name: [(group, y), ...]}."""
    values = [v for line in series.values() for point in line for v in point[1:] if v > 0.0] or [1.0]
    if log:
        low, high = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
        y_ticks = [10.0**k for k in range(low, high + 1)]
        scale = lambda y: (math.log10(max(y, 10.0**low)) - low) / max(high - low, 1)
    else:
        step = 10.0**math.floor(math.log10(max(values)))
        y_ticks = [step * k for k in range(math.ceil(max(values) / step) + 1)]
        scale = lambda y: y / y_ticks[-1]
    most = len(names) or max(point[0] for line in series.values() for point in line)
    at = lambda x, y: f"{70 + 470 * x / most:.1f} {250 - 220 * scale(y):.1f}"
    write = lambda x, y, text, anchor="middle": (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" stroke="none">{text}</text>\n')
    body = [write(280, 18, title), '<path d="M70 30V250H540" fill="none" stroke="black"/>\n']
    body += [write(62, 254 - 220 * scale(y), f"{y:g}", "end") for y in y_ticks]
    ticks = [(k + 0.5, name) for k, name in enumerate(names)] or [
        (most * k / 5, f"{most * k / 5:g}") for k in range(6)]
    body += [write(70 + 470 * x / most, 266, text) for x, text in ticks]
    for k, (colour, (name, line)) in enumerate(zip(COLOURS, series.items())):
        body.append(f'<g fill="{colour}" stroke="{colour}">\n')
        body.append(write(80 + 150 * k, 289, name, "start"))
        if names:
            body += [f'<path stroke-width="24" d="M{at(x + 0.35 + 0.3 * k, 0)}L'
                     f'{at(x + 0.35 + 0.3 * k, y)}"/>\n' for x, y in line]
        else:
            band = [at(p[0], p[2]) for p in line] + [at(p[0], p[3]) for p in reversed(line)]
            body.append(f'<path stroke="none" opacity="0.2" d="M{"L".join(band)}Z"/>\n'
                        f'<path fill="none" d="M{"L".join(at(p[0], p[1]) for p in line)}"/>\n')
        body.append("</g>\n")
    with open(path, "w", encoding="utf-8") as file:
        file.write('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 560 300" font-size="12" '
                   'font-family="sans-serif">\n' + "".join(body) + "</svg>\n")


def picture(caption, name):
    return f"![{caption}](figures/{name})\n\n"


# ---------------------------------------------------------------------------- outlier rejection

class Search:
    """One search on the closures of one seed, addition by addition."""

    def __init__(self, additions):
        self.search_s = [number(entry, "search_s") or 0.0 for entry in additions]
        self.clique = [number(entry, "clique") or 0.0 for entry in additions]

    def recent_ms(self, vertices):
        """Median over the last 50 additions before the graph has so many vertices."""
        return 1e3 * statistics.median(self.search_s[max(vertices - 50, 0):vertices])

    def clique_at(self, vertices):
        return self.clique[vertices - 1]


def pcm_section(results):
    searches = {}
    for match in sorted(results.matches(r"pcm-(\d+)\.json"), key=lambda match: int(match[1])):
        tree = results.json(match[0])
        for run in [tree] if isinstance(tree, dict) else tree:
            if run.get("additions"):
                searches.setdefault(run.get("search", "?"), []).append(Search(run["additions"]))
    if not searches:
        return ""
    size = min(len(run.clique) for runs in searches.values() for run in runs)
    sizes = [at for at in (100, 250, 500, 1000, 1500) if at < size] + [size]

    def column(runs, value, decimals, in_sum):
        return lambda at: Spread(value(run, at) for run in runs).cell(decimals) if at else in_sum(runs)

    sum_of = lambda runs: Spread(1e3 * sum(run.search_s) for run in runs).cell(1)
    columns = {"vertices": lambda at: str(at) if at else "all additions, in sum"}
    for name, runs in searches.items():
        columns[f"search of one addition [ms]: {name}"] = column(runs, Search.recent_ms, 3, sum_of)
    for name, runs in searches.items():
        columns[f"clique: {name}"] = column(runs, Search.clique_at, 0, lambda runs: "")
    figures = ""
    for name, title, value in (("pcm-time", "Time of one addition [ms]", Search.recent_ms),
                               ("pcm-clique", "Size of the clique", Search.clique_at)):
        lines = {search: [(at, spread.median, spread.lowest, spread.highest)
                          for at in range(max(1, size // 150), size + 1, max(1, size // 150))
                          for spread in [Spread(value(run, at) for run in runs)]]
                 for search, runs in searches.items()}
        write_chart(results.file(f"figures/{name}.svg"), f"{title} against vertices", lines,
                    log=value == Search.recent_ms)
        figures += picture(f"{title} against vertices: medians over the seeds, from lowest to highest.",
                           name + ".svg")
    for name in ("incremental", "exact"):
        add_search_targets(results, name, list(zip(searches.get(name, []), searches.get("batch", []))))
    return (
        "Closures of the Manhattan graph and random false ones enter the consistency graph one at a "
        "time. After each the clique of closures that agree is searched from scratch (batch), improved "
        "from the new vertex only (incremental, as in the paper), or found exactly (exact, ours). The "
        "paper shows two plots without numbers: incremental is much faster, and its cliques are of "
        "comparable size.\n\n"
        + table("Fig. 5 as numbers: search time and clique against vertices", columns, [*sizes, None],
                "Times: processor time of one thread, median of the last 50 additions. Values are medians "
                f"over {len(next(iter(searches.values())))} seeds of the false closures, with the lowest "
                "and highest.")
        + figures)


def add_search_targets(results, name, pairs):
    if not pairs:
        return
    where = f"pose graph with outliers, {len(pairs)} seeds, the worst"
    faster = min(sum(batch.search_s) / max(1e-9, sum(run.search_s)) for run, batch in pairs)
    share = min(100.0 * run.clique[-1] / max(1.0, batch.clique[-1]) for run, batch in pairs)
    results.target(f"{name} search against batch, all additions", where, "faster",
                   fixed(faster, 1 if faster < 10.0 else 0) + " times as fast", faster > 1.0, False)
    results.target(f"{name} search: clique against batch", where, "comparable (at least 98 %)",
                   fixed(share, 1) + " %", share >= 98.0, False)


# ---------------------------------------------------------------------------- COSMO-Bench

def cosmo_section(results):
    sets = {name: results.json(f"cosmo-{name}.json") for name in COSMO
            if results.has(f"cosmo-{name}.json")}
    for name, tree in sets.items():
        ate_m = number(tree, "ate", "team_m")
        best_m = min(value for values in PUBLISHED_COSMO_M[name] for value in values)
        if ate_m is not None:  # published values are rounded
            results.target("ATE on COSMO-Bench", COSMO[name],
                           f"at most {fixed(best_m, 2)} m, the best published",
                           fixed(ate_m, 2) + " m", ate_m < best_m + 0.005, False)

    def share(place, part, other):
        count = lambda name, key: number(sets[name], "closures", place, key) or 0.0
        return lambda name: f"{count(name, part):.0f} of {count(name, part) + count(name, other):.0f}"

    def value(decimals, *keys):
        return lambda name: fixed(number(sets[name], *keys), decimals)

    def published(k):
        return lambda name: ", ".join(fixed(value, 2 if value < 100.0 else 0)
                                      for value in PUBLISHED_COSMO_M[name][k]) or "-"

    def last_round(decimals, key):
        return lambda name: fixed(number((sets[name].get("rounds") or [{}])[-1], key), decimals)

    return sets and (
        "Real graphs of several robots whose false closures are labelled. The team is given all of a "
        "graph at once and finds out by itself how noisy closures are and which are false. It uses no "
        "label and no true pose.\n\n"
        + table("COSMO-Bench: closures and ATE of all robots in one frame", {
            "set": lambda name: COSMO[name],
            "poses": value(0, "poses"),
            "true closures lost: inside robots": share("inside", "true_lost", "true_kept"),
            "true closures lost: between robots": share("between", "true_lost", "true_kept"),
            "false closures kept: inside robots": share("inside", "false_kept", "false_rejected"),
            "false closures kept: between robots": share("between", "false_kept", "false_rejected"),
            "ATE [m]: ours": value(2, "ate", "team_m"),
            "ATE [m]: optimum of the true closures": value(2, "optimum_of_true", "team_m"),
            "ATE [m]: ratio": value(2, "ate_ratio"),
            "published ATE [m]: IRLS-GNC variants": published(0),
            "published ATE [m]: GTSAM GNC-GM": published(1),
            "solve: rounds": last_round(0, "round"),
            "solve: critical path [s]": last_round(3, "critical_path_s")}, list(sets),
                "ATE: RMSE of the positions of all poses under one rigid alignment. The optimum of the "
                "true closures trusts every closure that is not labelled false. Published values: "
                "centralised, priors dropped, from chained odometry, one rigid alignment of all robots "
                "(tables of UMich-RobotExploration/variable-projection)."))


# ---------------------------------------------------------------------------- trajectories

def paper_of(values, run, method):
    """The paper's values of a world, and that of a method; None without one."""
    theirs = values.get(run.name)
    return theirs, theirs[PAPER_COLUMNS.index(method)] if theirs and method in PAPER_COLUMNS else None


def half_table(worlds, caption, name, digits, papers, further, note):
    """One half of Table I. The best distributed result, and those with the same text, are bold."""
    methods = {title: method for method, title in METHODS.items()}
    values = dict(further)
    for title, method in methods.items():
        values[title] = lambda run, method=method: getattr(run.solutions[method], name)

    def cell(title):
        text = lambda run, title: significant(values[title](run), digits)

        def of(run):
            if title == "live":
                return fixed(run.live_m, 3)
            known = {other: value(run) for other, value in values.items()
                     if other not in (METHODS["centralized"], "live") and math.isfinite(value(run))}
            ours, (_, paper) = text(run, title), paper_of(papers, run, methods.get(title))
            if title in known and ours == text(run, min(known, key=known.get)):
                ours = strong(ours)
            return beside(ours, "" if paper is None else f"{paper:g}")

        return of

    return table(caption, {"world": title_of, **{title: cell(title) for title in values}}, worlds, note)


def trajectory_tables(results, worlds):
    by_paper = lambda run: results.run(run.name + "-paper", run.title)
    # The centralised method finds the optimum itself; the default has another cost.
    gap_methods = [method for method in METHODS if method not in ("centralized", "newton")]

    def gap(method):
        def of(run):
            all_of, paper = paper_of(PAPER_COST, run, method)
            theirs = 100.0 * (paper / all_of[-1] - 1.0) if all_of else NAN
            return beside(significant(run.solutions[method].gap_percent, 2),
                          significant(theirs, 2) if all_of else "")

        return of

    def spread(decimals, value):
        return lambda run: Spread(value(other) for other in results.runs_of(run)).cell(decimals)

    lost = "".join(
        f"{run.title}: {robot.name} never met the others. It is not judged with them, pictures show it "
        "in a frame of its own, and there is no solution for all together. "
        for run in worlds for robot in run.robots if not robot.joined)
    return (
        table("The inputs", {
            "world": title_of, "robots": lambda run: str(len(run.robots)),
            "images": lambda run: run.images,
            "time of each [s]": lambda run: ", ".join(fixed(r.recorded_s, 0) for r in run.robots),
            "distance [m]": lambda run: ", ".join(fixed(r.distance_m, 0) for r in run.robots),
            "closures kept": lambda run: fixed(run.closures, 0),
            "of them true": lambda run: fixed(run.true_closures, 0)}, worlds, lost)
        + half_table(
            worlds, "Table I: absolute trajectory error of the keyframes [m]", "error_m", 3,
            PAPER_ATE_M, {
                "published by the robots": lambda run: run.joint_m,
                "published, PCM then RBCD": lambda run: by_paper(run).joint_m if by_paper(run) else NAN,
                "live": lambda run: run.live_m},
            "Values are the RMSE of all robots under one alignment. The best distributed result is bold; "
            "the paper's centralised one is SE-Sync. Published by the robots: their optimized.tum at the "
            "end of the run, a pose for every image. Live: their live.tum, the pose known when each "
            "image came, since the robots joined.")
        + half_table(
            worlds, "Table I: cost of pose graph optimisation", "cost", 5, PAPER_COST, {},
            "Chordal cost of rigid poses without 1/2, weights as SE-Sync reads them. Costs of two worlds "
            "cannot be compared: they grow with the number of closures and with what these claim of "
            "their accuracy. A method that rejects closures has none.")
        + table("Cost above the centralised optimum [%]",
                {"world": title_of, **{METHODS[method]: gap(method) for method in gap_methods}}, worlds)
        + "".join(f"[{run.title}, {METHODS[method]}: keyframes from above, truth in grey.]"
                  f"(figures/trajectory-{run.name}-{method}.html)\n\n"
                  for run in worlds for method in ("local", "newton")
                  if results.has(f"figures/trajectory-{run.name}-{method}.html"))
        + table("Odometry alone, and what the team makes of it", {
            "robot": lambda one: f"{one[0].title}, {one[1].name}",
            "distance [m]": lambda one: fixed(one[1].distance_m, 0),
            "odometry, aligned alone: ATE [m]": lambda one: beside(
                fixed(one[1].odometry_m, 3),
                fixed(PUBLISHED_ODOMETRY_M[one[1].name], 2) if one[1].name in PUBLISHED_ODOMETRY_M else ""),
            "odometry, aligned alone: ATE / distance [%]": lambda one: fixed(one[1].drift_percent(), 3),
            "in the team: ATE [m]": lambda one: fixed(one[1].optimized_m, 3)},
                [(run, robot) for run in worlds for robot in run.robots],
                "RMSE over every image. In brackets: as published for Kimera-VIO on the original images.")
        + table("How much runs differ: median, and lowest to highest", {
            "world": title_of, "runs": lambda run: str(len(results.runs_of(run))),
            "ATE [m]: published by the robots": spread(4, lambda run: run.joint_m),
            "ATE [m]: local PGO": spread(4, lambda run: run.solutions["local"].error_m),
            "ATE [m]: RBCD": spread(4, lambda run: run.solutions["rbcd"].error_m),
            "RBCD: gap [%]": spread(4, lambda run: run.solutions["rbcd"].gap_percent),
            "odometry: mean ATE [m]": spread(4, lambda run: run.odometry_m),
            "closures kept": spread(0, lambda run: run.closures)},
                [run for run in worlds if len(results.runs_of(run)) > 1],
                "The tables above are of the first run. Further runs are on the same recordings, or on "
                "those of another seed of the world (RUNS, SEEDS), without a map. Robots are processes "
                "that meet when they do, so no two runs are the same."))


def add_trajectory_targets(results, worlds):
    """Trajectories are judged by the median of all runs, costs by the highest."""
    for world in worlds:
        runs = results.runs_of(world)
        for what, value in (("RBCD", lambda run: run.solutions["rbcd"].error_m),
                            ("what the robots published", lambda run: run.joint_m)):
            ratio = Spread(divided(value(run), run.solutions["local"].error_m) for run in runs)
            if ratio.count > 0 and world.name in PAPER_ATE_M:
                wanted = PAPER_ATE_M[world.name][1] / PAPER_ATE_M[world.name][0]
                results.target(f"ATE of {what} over that of local PGO", world.title,
                               f"at most {fixed(wanted, 2)}, the paper's",
                               fixed(ratio.median, 2) + ratio.range_text(2), ratio.median <= wanted)
        gap = Spread(run.solutions["rbcd"].gap_percent for run in runs)
        if gap.count > 0:
            results.target("cost of RBCD above the optimum", world.title,
                           f"at most {PAPER_MOST_RBCD_GAP_PERCENT:g} %",
                           significant(gap.highest, 2) + " %",
                           gap.highest <= PAPER_MOST_RBCD_GAP_PERCENT, False)
    for run in worlds:
        for robot in run.robots:
            where, most = f"{run.title}, {robot.name}", PUBLISHED_ODOMETRY_M.get(robot.name)
            drift = robot.drift_percent()
            if robot.odometry_m is not None and most is not None:
                results.target("ATE of odometry", where, f"at most {fixed(most, 2)} m",
                               fixed(robot.odometry_m, 3) + " m", robot.odometry_m <= most)
            elif drift is not None:
                results.target("ATE of odometry over the distance", where, "at most 0.5 %",
                               fixed(drift, 3) + " %", drift <= 0.5)


def trajectory_section(results):
    worlds = results.worlds()
    add_trajectory_targets(results, worlds)
    return worlds and (
        "A team runs in each world. The first columns have the trajectories that its robots published "
        "at the end of the run. One more run uses the paper's own pipeline: consistent closures by PCM, "
        "then RBCD. Every method also solves the pose graph that the team ends with by its defaults: "
        "odometry and the closures it kept. Local PGO joins the robots' own solutions by one closure "
        "each. RBCD, also stopped after 50 rounds, sees only its robot's part and the messages of the "
        "others. The centralised method certifies its optimum. RBCD and the centralised method start from "
        "the chordal initialisation of the whole graph. One computer makes it, and its cost is not "
        "counted. Like the paper's, they do not use the verticals that robots know. The default, "
        "Newton's method, starts from odometry as the robots do, weighs the closures, and uses the "
        "verticals.\n\n" + trajectory_tables(results, worlds))


# ---------------------------------------------------------------------------- resources

def communication_tables(results, worlds):
    def both(name, decimals, key, value=getattr):
        """Our value and the paper's."""
        return lambda run: beside(fixed(value(run, name), decimals), fixed(
            PAPER_RESOURCES[run.name][key], decimals) if run.name in PAPER_RESOURCES else "")

    def ours(name, decimals):
        return lambda run: fixed(getattr(run, name), decimals)

    def spread(name, decimals):
        return lambda run: Spread(getattr(other, name) for other in results.runs_of(run)).cell(decimals)

    def of_method(method, name, decimals, key=None, paper_decimals=2):
        def of(run):
            paper = PAPER_RESOURCES.get(run.name, {}).get(key)
            return beside(fixed(getattr(run.solutions[method], name), decimals),
                          fixed(paper, paper_decimals) if paper else "")

        return of

    return (
        table("Table II: communication [MB]", {
            "world": title_of, "poses": both("keyframes", 0, "poses"),
            "edges": of_method("rbcd", "edges", 0, "edges", 0),
            "distributed: place recognition": both("places", 2, "places"),
            "distributed: verification": both("verification", 2, "verification"),
            "distributed: PGO (RBCD)": both("pgo", 2, "pgo"),
            "distributed: total": both("total", 2, "total"),
            "centralised: images": both("images_mb", 1, "images"),
            "centralised: keypoints": both("keypoints", 2, "keypoints"),
            "of keypoints [%]": both("total_percent", 0, "percent")}, worlds,
              "Bytes as serialized, of all robots. PGO: one solve of the final graph by RBCD, as in the "
              "paper. Images: two of one byte per pixel for every keyframe, as in the paper's numbers. "
              "Keypoints: every keyframe once, with all its keypoints at 40 bytes: 8 of position and 32 "
              "of descriptor. Our robots send the strongest keypoints only: 6 bytes of position and "
              "word, and 12 of descriptor if the positions agree.")
        + table("Optimisation: what one solve sends, and what the running team sent [MB]", {
            "world": title_of, "RBCD": ours("pgo", 2), "Newton, the default": ours("newton", 2),
            "during the whole run": ours("live_pgo", 2),
            "all of the run / keypoints [%]": ours("run_percent", 0),
            "all of the run, other bytes included": ours("all_sent", 2),
            "these / as many keypoints [%]": ours("equal_percent", 0)}, worlds,
                "The running team solves again as closures come; the paper's solves once. Other bytes: "
                "statuses and messages for robots out of reach, but no meshes and objects. The last "
                "share is that of a server that receives each keyframe with as many keypoints as the "
                "robots receive of a keyframe in the mean.")
        + table("How much runs differ: median, and lowest to highest [MB]", {
            "world": title_of, "runs": lambda run: str(len(results.runs_of(run))),
            "place recognition": spread("places", 2), "verification": spread("verification", 2),
            "all solves of the run": spread("live_pgo", 2), "one solve by RBCD": spread("pgo", 2),
            "total, one solve / keypoints [%]": spread("total_percent", 1)},
                [run for run in worlds if len(results.runs_of(run)) > 1])
        + table("Table II: rounds and seconds of optimisation", {
            "world": title_of, "RBCD: rounds": of_method("rbcd", "rounds", 0, "rbcd_rounds", 0),
            "RBCD: [s]": of_method("rbcd", "seconds", 3, "rbcd_s"),
            "RBCD, 50 rounds: [s]": of_method("rbcd50", "seconds", 3, "rbcd50_s"),
            "centralised: [s]": of_method("centralized", "seconds", 3, "se_sync_s"),
            "Newton, the default: rounds": of_method("newton", "rounds", 0),
            "Newton, the default: [s]": of_method("newton", "seconds", 3)}, worlds,
                "Seconds: processor time of the slowest robot of every exchange, summed, all in one "
                "process: without what the network adds. A method has finished when its cost is within "
                "1e-6 of its last; the paper gives the rounds it ran."))


def lone_robot(results):
    """The robot that ran without a team and without a map; None without results."""
    for folder in sorted(glob.glob(os.path.join(results.data, "*_alone"))):
        robot = Process(folder)
        stamps = [row[0] for row in read_trajectory(os.path.join(folder, "odometry.tum"))]
        robot.recorded_s = 1e-9 * (stamps[-1] - stamps[0])
        return robot
    return None


def processor_tables(worlds, alone):
    """The second table has the modules whose steps take most of a robot's time."""
    processes = [(f"{alone.name}, odometry alone", alone)] if alone else []
    processes += [(f"{run.title}, {robot.name}", robot) for run in worlds for robot in run.robots]
    profiles = [(f"{alone.name} alone", [alone])] if alone else []
    profiles += [(run.title, run.robots) for run in worlds]
    share = lambda robots, module: statistics.fmean(robot.share_percent(module) for robot in robots)
    most = {module: max(share(robots, module) for _, robots in profiles)
            for _, robots in profiles for robot in robots for module in robot.module_s}
    columns = {"module": lambda module: module}
    for title, robots in profiles:
        columns[title] = lambda module, robots=robots: fixed(share(robots, module), 1)
    return (
        table("Processor time and memory", {
            "robot": lambda one: one[0],
            "with its map": lambda one: "yes" if "semantic_mapping" in one[1].module_s else "no",
            "recording [s]": lambda one: fixed(one[1].recorded_s, 0),
            "CPU time [s]": lambda one: fixed(one[1].processor_s, 1),
            "cores": lambda one: fixed(one[1].cores(), 2),
            "peak memory [MB]": lambda one: fixed(one[1].memory_mb, 0)}, processes,
              "CPU time of the robot's process, user and system, all threads, from start to end. Cores: "
              "that over the length of the recording, so what it takes at the recording's rate. "
              "Recordings are played as fast as they are taken (--rate max), which is the same work. "
              "Odometry alone: one robot without others and with mapping.mode=off; place recognition "
              "and optimisation over its own closures still run.")
        + table("Share of each module in the time of all steps [%], mean of the robots",
                columns, sorted((module for module in most if most[module] >= 0.5),
                                key=lambda module: (-most[module], module)),
                "By the clock on the wall: a step also waits for a core. Steps of the map wait longest, "
                "because odometry has priority."))


def resources_section(results):
    """The paper counts one solve. The bytes that the team actually sent have the same target."""
    worlds, alone = results.worlds(), lone_robot(results)
    most = f"at most {PAPER_MOST_SHARE_PERCENT:.0f} %"
    for world in worlds:
        for what, wanted, name in (
                ("all keypoints sent, one solve, as the paper counts", ", aim 10 %", "total_percent"),
                ("all keypoints sent, all solves of the run", "", "run_percent"),
                ("as many keypoints as robots receive, all of the run", ", aim 10 %", "equal_percent")):
            percent = Spread(getattr(run, name) for run in results.runs_of(world))
            if percent.count > 0:
                results.target("communication over " + what, world.title, most + wanted,
                               fixed(percent.median, 0) + " %" + percent.range_text(0),
                               percent.median <= PAPER_MOST_SHARE_PERCENT)
    judged = [("processor of odometry alone, 20 Hz", alone.name, alone, "0.5 cores", 0.5)] if alone else []
    judged += [("processor of a whole robot", f"{run.title}, {robot.name}", robot, "1 core", 1.0)
               for run in worlds for robot in run.robots]
    for what, where, robot, wanted, cores in judged:
        if robot.cores() is not None:
            results.target(what, where, "at most " + wanted, fixed(robot.cores(), 2) + " cores",
                           robot.cores() <= cores)
    return (worlds or alone) and (
        "The bytes that robots send to each other, beside those of a centralised system that sends every "
        "keyframe to a base station, as images or as keypoints with descriptors. Further tables have "
        "what optimisation and the robots as a whole cost.\n\n" + communication_tables(results, worlds)
        + processor_tables(worlds, alone))


# ---------------------------------------------------------------------------- meshes

def change_columns(groups, names, less):
    """Two columns of a group, before and after the correction; the better one is bold."""
    def cell(name, after):
        def of(one):
            states = [getattr(mesh, name) for mesh in one[2:4]]
            text = fixed(states[after], 2)
            if None not in states:
                better = states[1] < states[0] if less else states[1] > states[0]
                text = strong(text) if after == better else text
            paper = one[4][after] if name == "labels" and one[4] else None
            return beside(text, fixed(paper, 2) if paper else "")

        return of

    return {f"{group}: {state}": cell(name, after) for group, name in zip(groups, names)
            for after, state in enumerate(("before", "after"))}


def mesh_rows(worlds):
    """(run, mesh, before, after, the paper's labels of it)"""
    rows = []
    for run in worlds:
        labels = list(zip(*PAPER_LABELS.get(run.name, ((), ()))))
        fits = len(labels) == len(run.meshes)
        rows += [(run, *mesh, labels[k] if fits else None) for k, mesh in enumerate(run.meshes)]
    return rows


def add_change_target(results, run, what, name, unit, less):
    before, after = getattr(run.before, name), getattr(run.after, name)
    if before is not None and after is not None:
        results.target(what, run.title, ("less" if less else "more") + " after the correction",
                       f"{fixed(before, 2)} to {fixed(after, 2)} {unit}",
                       after < before if less else after > before)


NAMED_MESH = {"mesh": lambda one: f"{one[0].title}, {one[1]}"}
GROUPS = ("as the paper measures it", "without what no robot saw", "the way back")


def mesh_section(results):
    worlds = [run for run in results.worlds() if (run.before.error or run.after.error) is not None]
    charts, pictures = "", "".join(
        picture(f"{run.title}, {state} the correction", f"mesh-{run.name}-{state}.png")
        for run in results.worlds() for state in ("before", "after")
        if results.has(f"figures/mesh-{run.name}-{state}.png"))
    for run in worlds:
        names, before, after = zip(*run.meshes)
        bars = {state: [(k, or_nan(mesh.seen)) for k, mesh in enumerate(meshes)]
                for state, meshes in (("before", before), ("after", after))}
        write_chart(results.file(f"figures/mesh-error-{run.name}.svg"),
                    f"{run.title}: mesh error [cm]", bars, names)
        charts += picture(f"{run.title}: without what no robot saw.", f"mesh-error-{run.name}.svg")
        what = "error of the merged mesh"
        add_change_target(results, run, what, "error", "cm", True)
        add_change_target(results, run, what + ", without what no robot saw", "seen", "cm", True)
    return (worlds or pictures) and (
        "Meshes as odometry built them, moved as a whole into the team's frame. The same meshes after "
        "local mesh optimisation bent them to the team's solution. \"Merged\" is the mesh of all robots "
        "together. The paper shows its errors as bars without numbers.\n\n"
        + charts
        + table("Fig. 7 as numbers: mesh error before and after the correction [cm]",
                {**NAMED_MESH, **change_columns(GROUPS, ("error", "seen", "back"), True)},
                mesh_rows(worlds),
                "Mean distance from points of the true mesh to the nearest of the estimated one, after "
                "ICP of all together. There are up to 1000 points a square metre, and two millions in "
                "all. Only true points within 0.5 m of the estimate count. The middle leaves out true "
                "surface past the mesh's rim or behind it. The way back: from points of the estimated "
                "mesh to the true one. Copies of a surface that are spread about it have a nearer point "
                "to most true points than copies that agree. Only the way back distinguishes the two.")
        + pictures)


def semantics_section(results):
    worlds = [run for run in results.worlds() if (run.before.labels or run.after.labels) is not None]
    for run in worlds:
        add_change_target(results, run, "right labels of the merged mesh", "labels", "%", False)
        if run.name in PAPER_LABELS and run.after.labels is not None:
            wanted = PAPER_LABELS[run.name][1][-1]
            results.target("right labels of the merged mesh, corrected", run.title,
                           f"at least {fixed(wanted, 2)} %, the paper's",
                           fixed(run.after.labels, 2) + " %", run.after.labels >= wanted)
    return worlds and (
        "Labels come from the simulator's images of classes, as in the paper. Each vertex of the mesh "
        "has the most likely one of the labels of all its views. The paper has no truth for the Vicon "
        "rooms; ours are rendered, so there is one.\n\n"
        + table("Table III: right labels before and after the correction [%]",
                {**NAMED_MESH, **change_columns(GROUPS[:2], ("labels", "seen_labels"), False)},
                mesh_rows(worlds),
                "Share of the true points within 0.2 m of the mesh whose nearest point has their label."))


# ---------------------------------------------------------------------------- levels of difficulty

class Level:
    """Runs of a level of difficulty, or one of them. Joint errors are of runs whose robots all
    joined."""

    def __init__(self, title, runs):
        self.title, self.runs = title, runs
        joined = [run for run in runs if run.joined == len(run.robots)]
        self.joined = len(joined)
        self.odometry_m = Spread(robot.odometry_m for run in runs for robot in run.robots)
        self.before_m = Spread(number(run.results.json(f"ate-{run.name}-odometry.json"),
                                      "joint", "position_m", "rmse") for run in joined)
        self.after_m = Spread(run.joint_m for run in joined)
        self.nees = Spread(number(named(run.results.json(f"nees-{run.name}.json"), "all poses"),
                                  "median") for run in joined)
        self.share_percent = Spread(run.equal_percent for run in runs)
        self.kept = int(sum(run.closures or 0.0 for run in runs))
        self.wrong = self.kept - int(sum(run.true_closures or 0.0 for run in runs))
        self.divergences = int(sum(robot.divergences for run in runs for robot in run.robots))

    def recall(self, k):
        """Of pairs in a bin of 30 degrees."""
        bins = [run.by_angle[k] for run in self.runs if k < len(run.by_angle)]
        pairs, found = (sum(entry.get(key, 0) for entry in bins) for key in ("true_pairs", "pairs_found"))
        return f"{fixed(100.0 * found / pairs, 1)}% of {pairs}" if pairs else "-"


def levels_of(results):
    """By level and length: the level, and each of its runs."""
    worlds, levels = list(LEVEL_WORLDS), {}
    found = results.matches(r"team-(level(\d+)-(\w+)-seed(\d+))\.json")
    found = [match for match in found if match[3] in worlds]
    for match in sorted(found, key=lambda m: (int(m[2]), worlds.index(m[3]), int(m[4]))):
        title, length = LEVEL_WORLDS[match[3]]
        run = results.run(match[1], f"{title}, level {match[2]}, seed {match[4]}")
        levels.setdefault((int(match[2]), length), []).append(run)
    return [(level, Level(f"{level}, {length}" if length else str(level), runs),
             [Level(run.title, [run]) for run in runs])
            for (level, length), runs in sorted(levels.items())]


def add_level_targets(results, level):
    where, runs = "level " + level.title, len(level.runs)
    results.target("runs in which all robots joined", where, f"{runs} of {runs}",
                   f"{level.joined} of {runs}", level.joined == runs)
    share, wanted = level.share_percent, 0.5 * level.odometry_m.median
    if share.count > 0:
        results.target("communication over as many keypoints as robots receive, worst run", where,
                       f"at most {PAPER_MOST_SHARE_PERCENT:.0f} %", fixed(share.highest, 0) + " %",
                       share.highest <= PAPER_MOST_SHARE_PERCENT)
    results.target("false closures kept", where, "0", str(level.wrong), level.wrong == 0)
    if level.after_m.count > 0:
        results.target("median joint ATE", where,
                       f"at most {fixed(wanted, 3)} m, half of the median odometry ATE",
                       fixed(level.after_m.median, 3) + " m", level.after_m.median <= wanted)


def levels_section(results):
    levels = levels_of(results)
    for number_of, level, _ in levels:
        if number_of == 2:  # a usual robot: the level with numbers to reach
            add_level_targets(results, level)

    def cell(name, decimals):
        return lambda level: getattr(level, name).cell(decimals)

    return levels and (
        "Levels of difficulty of kimera_multi_simulate: 0 has exact sensors in calm light, 2 those of a "
        "usual robot, 4 everything at its worst. A map is not built.\n\n"
        + table("Levels of difficulty: medians, and ranges over robots and runs", {
            "level": title_of, "joined": lambda level: f"{level.joined} of {len(level.runs)}",
            "odometry ATE [m]": cell("odometry_m", 3), "joint ATE [m]: before": cell("before_m", 3),
            "joint ATE [m]: after": cell("after_m", 3), "closures kept: all": lambda x: str(x.kept),
            "closures kept: false": lambda level: str(level.wrong), "NEES, median": cell("nees", 2),
            "bytes [%]": cell("share_percent", 0), "divergences": lambda x: str(x.divergences)},
                [row for _, level, runs in levels for row in [level, *runs]],
                "Joint ATE: RMSE of all robots under one alignment, of runs in which all robots joined. "
                "Before: odometry, placed by the first optimised keyframe of each robot. NEES: of the "
                "published keyframes, over the median of its distribution; 1 is right. Bytes: sent in "
                "the whole run, relative to a server. It receives each keyframe with as many keypoints "
                "as the robots receive of a keyframe in the mean. Divergences: found and logged by the "
                "robots.")
        + table("Recall by viewing angle: pairs of keyframes with a kept closure", {
            "level": title_of, **{f"{30 * k} to {30 * k + 30} degrees":
                                  lambda level, k=k: level.recall(k) for k in range(6)}},
                [level for _, level, _ in levels],
                "Pairs of keyframes of two robots that see the same place by their true poses, whatever "
                "hides it, by the angle between the optical axes."))


# ---------------------------------------------------------------------------- maps

def maps_section(results):
    maps = sorted((match[1], match[2]) for match in results.matches(r"map-(\w+)-(mesh|open3d)\.json"))
    quality = lambda row: results.json(f"map-{row[0]}-{row[1]}.json")["quality"]

    def seen(part, name):
        return lambda row: percent(number(part(quality(row)), name))

    def percent(value):
        return fixed(100.0 * or_nan(value), 1)

    near, far = (lambda tree, k=k: tree["by_depth"][k] for k in range(2))
    buildings = lambda tree: tree["by_class"].get("building")

    return maps and (
        "Maps of one robot by true poses and recorded depth, as the robot makes them by default, beside "
        "Open3D's ScalableTSDFVolume with voxels of 0.1 m in the city and 0.05 m in rooms.\n\n"
        + table("Maps beside Open3D", {
            "world and seed": lambda row: row[0], "map": lambda row: {"mesh": "ours"}.get(row[1], row[1]),
            "seen below 10 m [%]: within 20 cm": seen(near, "within_20cm"),
            "seen below 10 m [%]: 5 cm": seen(near, "within_5cm"),
            "seen at 10 to 20 m [%]: 20 cm": seen(far, "within_20cm"),
            "buildings [%]: 20 cm": seen(buildings, "within_20cm"),
            "map to truth [%]: within 5 cm": lambda row: percent(quality(row)["within_5cm"]),
            "map to truth [%]: 10 cm": lambda row: percent(quality(row)["within_10cm"]),
            "walls [deg]": lambda row: fixed(quality(row)["wall_deg"], 1),
            "walls, rms [mm]": lambda row: fixed(quality(row)["wall_rms_mm"], 1)},
                maps, "Seen: true surface that the camera saw from this distance, with a mapped one near "
                "it."))


# ---------------------------------------------------------------------------- report

SECTIONS = {"pcm": ("Outlier rejection", pcm_section), "cosmo": ("COSMO-Bench", cosmo_section),
            "trajectory": ("Trajectories", trajectory_section),
            "resources": ("Communication and computation", resources_section),
            "mesh": ("Meshes", mesh_section), "semantics": ("Labels", semantics_section),
            "levels": ("Worlds that fight back", levels_section),
            "maps": ("Maps beside Open3D", maps_section)}


def targets_section(targets):
    judged = [target for target in targets if target[0] != "Not judged"]
    met = sum(target[0] == "Met" for target in judged)
    text = "Nothing was measured yet.\n\n" if not targets else (
        f"{met} of {len(judged)} are met"
        + ("; those that are not come first.\n\n" if met < len(judged) else ".\n\n"))
    for verdict in ("Missed", "Met", "Not judged"):
        last = 1 if verdict == "Not judged" else 0
        columns = {heading: lambda target, k=k: target[k]
                   for k, heading in enumerate(("what", "where", "wanted"), 1)}
        columns["measured"] = lambda target, last=last: target[4] if last else strong(target[4])
        text += table(verdict + ": inputs of full size answer these" * last, columns,
                      [target for target in targets if target[0] == verdict], words=True)
    return f"## Numbers to reach\n\n{text}", f"{met} of {len(judged)} numbers to reach are met"


def write_report(results):
    os.makedirs(results.file("figures"), exist_ok=True)
    texts = {name: section(results) for name, (_, section) in SECTIONS.items()}
    lead = (
        "Every table and figure of the evaluation of “Kimera-Multi: a System for Distributed Multi-Robot "
        "Metric-Semantic SLAM” (Chang, Tian, How, Carlone, ICRA 2021). Our value stands first, the "
        "paper's in brackets. Worlds are like the paper's in kind, not the same: compare ratios before "
        "values.")
    if results.quick:
        lead += (" These are the small versions (make quick), to see that all works: their numbers mean "
                 "little about the paper's.")
    missing = [name for name, text in texts.items() if not text]
    if missing:
        lead += f" No results so far: {', '.join(missing)}."
    targets, summary = targets_section(results.targets)
    with open(results.file("report.md"), "w", encoding="utf-8") as file:
        file.write(f"# Kimera-Multi: the paper's experiments\n\n{lead}\n\n{targets}")
        file.writelines(f"## {SECTIONS[name][0]}\n\n{text}" for name, text in texts.items() if text)
    print(f"{results.file('report.md')}: {summary}")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    command = commands.add_parser("tables")
    command.add_argument("--data", required=True)
    command.add_argument("--output", required=True)
    command.add_argument("--quick", action="store_true")
    for name, arguments in (("stamps", ("run", "poses", "output")), ("placed", ("run", "output")),
                            ("joined", ("team_json",))):
        command = commands.add_parser(name)
        for argument in arguments:
            command.add_argument(argument)
    given = parser.parse_args()
    if given.command == "tables":
        write_report(Results(given.data, given.output, given.quick))
    elif given.command == "stamps":
        write_stamped(given.run, given.poses, given.output)
    elif given.command == "placed":
        write_placed(given.run, given.output)
    elif not all_joined(read_json(given.team_json)):
        sys.exit(1)


if __name__ == "__main__":
    try:
        main()
    except (OSError, KeyError, ValueError) as error:
        sys.exit(f"tables.py: {error}")

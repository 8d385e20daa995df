#!/usr/bin/env python3
"""Measures the numbers of the main README, and writes its table of results.

  results.py run [PART ...] --programs DIR --data DIR --output DIR   measures into results.json
  results.py table README.md                                       writes the table of README.md
  results.py check README.md                                       exit code 1 if it is another one

results.json beside this file has for each part: the command, the commit, the machine, its load at the
start, and the values of every run. Without PART all parts run whose data are there.
"""

import argparse
import glob
import json
import os
import subprocess
import sys
import time

sys.dont_write_bytecode = True
import tables

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.join(HERE, "../../..")
RESULTS = os.path.join(HERE, "results.json")
BEGIN, END = "<!-- results.py table -->\n", "<!-- end -->\n"


class Span:
    """The values of all runs. Its format is the number of digits after the point."""

    def __init__(self, values):
        self.values = values

    def __format__(self, digits):
        low, high = (f"{value:.{digits}f}" for value in (min(self.values), max(self.values)))
        return low if low == high else f"{low} to {high}"


class Runner:
    """Runs programs for one part, in a folder of its own."""

    def __init__(self, options, part, run):
        self.programs, self.data = os.path.abspath(options.programs), options.data
        self.folder = os.path.join(os.path.abspath(options.output), part, str(run))
        os.makedirs(self.folder, exist_ok=True)

    def path(self, name):
        return os.path.join(self.folder, name)

    def read(self, name):
        with open(self.path(name), encoding="utf-8") as file:
            return json.load(file)

    def find(self, pattern):
        found = sorted(glob.glob(os.path.join(self.data, pattern)))
        if not found:
            raise FileNotFoundError(f"no {pattern} in {self.data}")
        return found[0]

    def call(self, program, *arguments):
        with open(self.path("log"), "a", encoding="utf-8") as log:
            subprocess.run([os.path.join(self.programs, program), *arguments], check=True, cwd=ROOT,
                           stdout=log, stderr=log)

    def demo(self, *arguments):
        self.call(os.path.join(ROOT, "apps/demo"), "--programs", self.programs, "--output", self.folder,
                  *arguments)
        return self.read("team.json")

    def solve(self, graph, *arguments):
        self.call("kimera_multi_pgo", "solve", graph, *arguments, "--json", self.path("pgo.json"))
        return self.read("pgo.json")


def errors_of(team):
    return {"odometry_mm": [1e3 * robot["odometry"]["position_m"]["rmse"] for robot in team["robots"]],
            "joint_mm": [1e3 * team["optimized"]["joint"]["position_m"]["rmse"]]}


def share_of(team):
    total = lambda *keys: sum(value_at(robot, keys) for robot in team["robots"])
    return [tables.equal_percent(total("traffic") - total("traffic", "map"), total("keyframes"),
                                 total("peer_keyframes", "keyframes"),
                                 total("peer_keyframes", "keypoints"))]


def value_at(node, keys):
    for key in keys:
        node = node.get(key, 0)
    return sum(node.values()) if isinstance(node, dict) else node


def demo(runner):
    team = runner.demo()
    front = team["optimized_meshes"]["merged"]["seen_truth_to_estimate"]["point"]["mean_m"]
    return errors_of(team) | {"front_mm": [1e3 * front], "share": share_of(team)}


def mh_01(runner):
    team = runner.demo(runner.find("euroc/MH_01_easy"), "--rate", "max")
    return errors_of(team) | {"share": share_of(team)}


def alone(runner, mapping):
    recording = runner.find("euroc/MH_01_easy")
    runner.call("kimera_multi_robot", "--robot", "0", "--config", "euroc", "--dataset", recording,
                "--rate", "1", "--set", f"mapping.mode={mapping}", "--output", runner.path(mapping))
    return runner.read(f"{mapping}/summary.json")


def one_robot(runner):
    """On stereo of 752x480 at 20 Hz."""
    result = {}
    for mapping in ("off", "metric"):
        summary = alone(runner, mapping)
        result[f"{mapping}_cores"] = [20.0 * summary["process"]["cpu_s"] / summary["frames"]]
    runner.call("kimera_multi_evaluate", "trajectory", "--truth",
                runner.find("euroc/MH_01_easy/mav0/state_groundtruth_estimate0/*.[ct]*"),
                "--estimate", runner.path("off/odometry.tum"), "--json", runner.path("ate.json"))
    odometry = runner.read("ate.json")["robots"][0]
    return result | {"odometry_mm": [1e3 * odometry["position_m"]["rmse"]]}


def cosmo(runner):
    names = {"kth_pro": "kth*proradio", "kth_wifi": "kth*wifi", "ntu_wifi": "ntu*wifi",
             "ntu_pro": "ntu*proradio"}
    result = {}
    for name, files in names.items():
        solved = runner.solve(runner.find(f"cosmo_bench/{files}.jrl"))
        result |= {name: [solved["ate"]["team_m"]],
                   f"{name}_true": [solved["optimum_of_true"]["team_m"]]}
    return result


def sphere(runner):
    solved = runner.solve(runner.find("pose_graphs/3d/sphere2500.g2o*"), "--robots", "8",
                          "--keep-steps")
    return {"rounds": [solved["rounds"][-1]["round"]], "sent_mb": [1e-6 * solved["most_sent"]]}


def dpgo(runner):
    """Processor time of all robots until the cost is within 1e-6 of the optimum [s]."""
    result = {}
    for graph in ("sphere2500", "torus3D"):
        for method in (("newton", "--trust-all"), ("rbcd", "--rounds", "400")):
            solved = runner.solve(runner.find(f"pose_graphs/3d/{graph}.g2o*"), "--robots", "5",
                                  "--method", *method)
            most = (1.0 + 1e-6) * solved["optimum"]
            cpu_s = next(r["total_cpu_s"] for r in solved["rounds"] if r["cost"] <= most)
            result[f"{graph}_{method[0]}_s"] = [solved["start_cpu_s"] + cpu_s]
    return result


def paper(runner):
    """From what `make trajectory` has left beside --output."""
    result = {}
    for world, unit in (("city", 1e-3), ("camp", 1e-3), ("v1", 1.0), ("v2", 1.0)):
        errors = errors_of(runner.read(f"../../../team-{world}.json"))
        place = world if unit < 1.0 else "rooms"
        for name, values in errors.items():
            result.setdefault(f"{place}_{name.split('_')[0]}", []).extend(unit * v for v in values)
    return result


# Each part: function, number of runs, and rows of the table: what, measured, command.
PARTS = {
    "demo": (demo, 3, [(
        "room of `apps/demo`, 70 s, three robots with a map: odometry; joint ATE; mesh error in front; "
        "bytes, as a share of a server that gets as many keypoints, packed equally",
        "{odometry_mm:0}; {joint_mm:0}; {front_mm:0} mm; {share:0} %", "`apps/demo`")]),
    "mh_01": (mh_01, 3, [("EuRoC MH_01, 15 s cut into two robots: joint ATE; bytes",
                          "{joint_mm:1} mm; {share:0} %", "`apps/demo MH_01_easy`")]),
    "paper": (paper, 1, [
        ("two Vicon rooms, recorded flights and inertial data, three robots: odometry; joint ATE",
         "{rooms_odometry:0}; {rooms_joint:0} mm", "`make trajectory`"),
        ("city, camp (worlds of commit f854792d), three robots: odometry; joint ATE",
         "{city_odometry:2}, {camp_odometry:2} m; {city_joint:2}, {camp_joint:2} m",
         "`make trajectory`")]),
    "cosmo": (cosmo, 1, [(
        "COSMO-Bench, four sets: ATE, beside that of the optimum of the true closures",
        "{kth_pro:2}, {kth_wifi:2}, {ntu_wifi:2}, {ntu_pro:2} m; "
        "{kth_pro_true:2}, {kth_wifi_true:2}, {ntu_wifi_true:2}, {ntu_pro_true:2} m",
        "`kimera_multi_pgo solve FILE.jrl`")]),
    "sphere": (sphere, 1, [("sphere2500, 8 robots: rounds; bytes per robot",
                            "{rounds:0}; {sent_mb:1} MB",
                            "`kimera_multi_pgo solve FILE --robots 8 --keep-steps`")]),
    "dpgo": (dpgo, 3, [(
        "sphere2500; torus3D on 5 robots, processor time to a gap of 1e-6: Newton, RBCD, dpgo",
        "{sphere2500_newton_s:1}, {sphere2500_rbcd_s:1}, 13.5; {torus3D_newton_s:1}, "
        "{torus3D_rbcd_s:1}, 19.1 s", "`kimera_multi_pgo solve FILE --robots 5`")]),
    "one_robot": (one_robot, 3, [
        ("EuRoC MH_01, 15 s, one robot: ATE of odometry; OpenVINS; Basalt",
         "{odometry_mm:1}; 5.2; 9.3 mm", "`kimera_multi_robot --rate 1`"),
        ("MH_01, 752x480 at 20 Hz, with the start: odometry and back-end; also a metric map by "
         "stereo", "{off_cores:2}; {metric_cores:2} of a core", "`kimera_multi_robot --rate 1`")]),
}


def load():
    with open(RESULTS, encoding="utf-8") as file:
        return json.load(file)


def machine():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        models = [line.split(":")[1].strip() for line in file if line.startswith("model name")]
    return f"{len(models)} x {models[0]}"


def run(options):
    for part in options.part or PARTS:
        function, runs, rows = PARTS[part]
        result = {"commands": [row[2].strip("`") for row in rows], "date": time.strftime("%Y-%m-%d"),
                  "commit": subprocess.check_output(["git", "rev-parse", "--short=8", "HEAD"], cwd=ROOT,
                                                    text=True).strip(),
                  "machine": machine(), "load": [], "runs": []}
        print(f"{part}: {runs} runs", flush=True)
        try:
            for number in range(runs):
                result["load"].append(round(os.getloadavg()[0], 1))
                result["runs"].append(function(Runner(options, part, number)))
        except FileNotFoundError as error:
            print(f"{part}: left out: {error}", file=sys.stderr)
            continue
        results = load() | {part: result}
        with open(RESULTS, "w", encoding="utf-8") as file:
            json.dump(results, file, indent=1)
            file.write("\n")


def table():
    lines = ["| what | measured | command |", "|---|---|---|"]
    results = load()
    for part, (_, _, rows) in PARTS.items():
        runs = results[part]["runs"]
        spans = {key: Span([v for values in runs for v in values[key]]) for key in runs[0]}
        lines += [f"| {what} | {measured.format(**spans)} | {command} |"
                  for what, measured, command in rows]
    return "\n".join(lines) + "\n"


def with_table(text):
    before, rest = text.split(BEGIN)
    return before + BEGIN + table() + END + rest.split(END, 1)[1]


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=("run", "table", "check"))
    parser.add_argument("part", nargs="*", help="part of run, or the README")
    for name in ("programs", "data", "output"):
        parser.add_argument(f"--{name}")
    options = parser.parse_args()
    if options.action == "run":
        return run(options)
    with open(options.part[0], encoding="utf-8") as file:
        text = file.read()
    if options.action == "check":
        return 0 if with_table(text) == text else "the table of results is not that of results.json"
    with open(options.part[0], "w", encoding="utf-8") as file:
        file.write(with_table(text))
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Tests of the Makefile and of tables.py: test_experiments.py PROGRAMS [TEST ...]"""

import importlib.util
import json
import math
import os
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

HERE = os.path.dirname(os.path.abspath(__file__))
EXPERIMENTS = os.path.join(HERE, "../../../../apps/lab/experiments")
PROGRAMS = os.path.abspath(sys.argv.pop(1))
spec = importlib.util.spec_from_file_location("tables", os.path.join(EXPERIMENTS, "tables.py"))
sys.dont_write_bytecode = True
tables = importlib.util.module_from_spec(spec)
spec.loader.exec_module(tables)

ROBOTS = ("robot0", "robot1", "robot2")


class Folder(tempfile.TemporaryDirectory):
    def path(self, name):
        return os.path.join(self.name, name)

    def write(self, name, content):
        os.makedirs(os.path.dirname(self.path(name)), exist_ok=True)
        with open(self.path(name), "w", encoding="utf-8") as file:
            file.write(content if isinstance(content, str) else json.dumps(content))

    def read(self, name):
        with open(self.path(name), encoding="utf-8") as file:
            return file.read()


def mesh(name, error_m, accuracy):
    """Errors of the surface that robots saw are half as large."""
    way = lambda mean_m: {"point": {"mean_m": mean_m}, "labels": {"accuracy": accuracy}}
    return {"name": name, "truth_to_estimate": way(error_m), "estimate_to_truth": way(0.0),
            "seen_truth_to_estimate": way(0.5 * error_m)}


def meshes(error_m, accuracy):
    return {"robots": [mesh(name, error_m, accuracy) for name in ROBOTS],
            "merged": mesh("merged", error_m, accuracy)}


def ate(rmse_m):
    return {"position_m": {"rmse": rmse_m}}


class CannedCity(Folder):
    """Small results of every step in the city: three robots that drive straight on, 1 m/s."""

    def __init__(self):
        super().__init__()
        for world in ("city", "level2-city-seed1"):
            self.write(f"data/{world}/simulation.json",
                       {"parameters": {"resolution": "376x240", "seed": "7"}})
            robots = [f"  - {{id: {k}, name: {name}, truth: {name}.csv}}\n"
                      for k, name in enumerate(ROBOTS)]
            self.write(f"data/{world}/team.yaml", "robots:\n" + "".join(robots))
            for k, name in enumerate(ROBOTS):
                self.write(f"data/{world}/{name}.csv", "".join(
                    f"{x + 1}000000000,{x},{k + 0.1 * x * x},0,1,0,0,0\n" for x in range(4)))
        for run, published_m in (("city", 0.006), ("city-run2", 0.006), ("city-run3", 0.006),
                                 ("city-paper", 0.008), ("level2-city-seed1", 0.006)):
            self.write_run(run, published_m)
        for name in ("mesh", "open3d"):
            near = {"within_5cm": 0.94, "within_20cm": 0.98}
            self.write(f"results/map-city4-{name}.json", {"quality": {
                "within_5cm": 0.84, "within_10cm": 0.93, "wall_deg": 5.06, "wall_rms_mm": 3.0,
                "by_depth": [near, {"within_20cm": 0.92}], "by_class": {"building": near}}})
        for run, share in (("city", 1.0), ("city-run2", 0.9), ("city-run3", 0.8)):
            for method in tables.METHODS:
                self.write_method(run, method, share)
        self.write("results/ate-level2-city-seed1-odometry.json", {"joint": ate(0.1085)})
        self.write("results/nees-level2-city-seed1.json", [{"name": "all poses", "median": 0.0}])
        self.write_process("data/city_alone", {"vio": 0.3, "sensors": 0.1}, name="robot0",
                           process={"cpu_s": 0.6, "peak_memory_bytes": 120000000})
        self.write("data/city_alone/odometry.tum", "1 0 0 0 0 0 0 1\n4 3 0 0 0 0 0 1\n")
        counts = lambda kept: {"true_kept": 99, "true_lost": 1, "false_kept": kept,
                               "false_rejected": 20 - kept}
        self.write("results/cosmo-kth_r3_00_d06_d09_d10_wifi.json", {
            "poses": 1604, "closures": {"inside": counts(0), "between": counts(2)},
            "rounds": [{"cost": 9.0}, {"round": 1, "cost": 8.0, "critical_path_s": 0.25}],
            "ate": {"team_m": 1.5}, "optimum_of_true": {"team_m": 2.0}, "ate_ratio": 0.75})
        for seed in (1, 2, 3):  # batch takes 4, 8, 12 times as long as the others
            self.write(f"results/pcm-{seed}.json", [
                {"search": name, "additions": [{"search_s": time_s, "clique": k}
                                               for k in range(1, 121)]}
                for name, time_s in (("batch", 0.004 * seed), ("incremental", 0.001),
                                     ("exact", 0.001))])
        for state in ("before", "after"):
            self.write(f"results/figures/mesh-city-{state}.png", "")

    def write_process(self, folder, modules, **summary):
        self.write(folder + "/summary.json", summary)
        self.write(folder + "/timing.csv", "module,calls,median_ms,p95_ms,max_ms,total_s\n" + "".join(
            f"{module},3,1,1,1,{seconds}\n" for module, seconds in modules.items()))

    def write_run(self, run, published_m):
        for name in ROBOTS:
            self.write_process(
                f"data/{run}_res/{name}", {"vio": 1.2}, keyframes=4, keypoints=4000,
                peer_keyframes={"keyframes": 2, "keypoints": 400},
                process={"cpu_s": 2.4, "peak_memory_bytes": 250000000},
                traffic={"place_recognition": 1000000, "geometric_verification": 2000000,
                         "pgo": 9000000})
        angles = [{"true_pairs": 10 * (k == 2), "pairs_found": 4 * (k == 2)} for k in range(6)]
        self.write(f"results/team-{run}.json", {
            "robots": [{"name": name, "in_team_frame": True, "odometry": ate(0.0123)} for name in ROBOTS],
            "optimized": {"joint": ate(published_m),
                          "robots": [{"name": name, **ate(0.0045)} for name in ROBOTS]},
            "live": {"joint": ate(1.5 * published_m)},
            "closures": {"inliers": {"judged": 817, "correct": 816}, "by_angle": angles},
            "meshes": meshes(0.08, 0.9), "optimized_meshes": meshes(0.06, 0.95)})

    def write_method(self, run, method, share):
        cost = {"decided": True} if method == "newton" else {
            "rounded_cost": 1060.0 if method == "rbcd" else 1000.0, "optimum": 1000.0}
        self.write(f"results/pgo-{run}-{method}.json", {
            "edges": 34, **cost, "rounds": [
                {"round": 0, "cost": 2000, "bytes": 0},
                {"round": 5, "cost": 1000, "bytes": 4321000, "critical_path_s": 0.125},
                {"round": 7, "cost": 1000, "bytes": 5000000, "critical_path_s": 0.5}]})
        errors_m = {"local": share, "rbcd": 0.5}
        self.write(f"results/ate-{run}-{method}.json", {"joint": ate(errors_m.get(method, 0.0))})

    def report(self, quick=False):
        tables.write_report(tables.Results(self.path("data"), self.path("results"), quick))
        return self.read("results/report.md")


class Tables(unittest.TestCase):
    maxDiff = None

    def test_all_tables_are_those_of_known_results(self):
        city = CannedCity()
        with open(os.path.join(HERE, "expected_report.txt"), encoding="utf-8") as file:
            self.assertEqual(city.report(), file.read())
        for name in ("pcm-time", "pcm-clique", "mesh-error-city"):
            xml.etree.ElementTree.fromstring(city.read(f"results/figures/{name}.svg"))

    def test_small_versions_are_judged_only_by_targets_that_they_can_decide(self):
        text = CannedCity().report(quick=True)
        self.assertIn("6 of 6 are met.", text)
        self.assertIn("**Not judged: inputs of full size answer these**", text)
        self.assertNotIn("**Missed**", text)

    def test_a_robot_that_never_met_the_others_is_named(self):
        city = CannedCity()
        team = json.loads(city.read("results/team-city.json"))
        team["robots"][2]["in_team_frame"] = False
        city.write("results/team-city.json", team)
        self.assertIn("City: robot2 never met the others.", city.report())

    def test_without_results_the_report_states_that_there_are_none(self):
        city = CannedCity()
        for name in ("pcm-1", "pcm-2", "pcm-3", "pgo-city-rbcd", "ate-city-rbcd"):
            os.remove(city.path(f"results/{name}.json"))
        text = city.report()
        self.assertIn("No results so far: pcm.", text)
        self.assertIn(" - (1113.1) ", text)
        folder = Folder()
        tables.write_report(tables.Results(folder.name, folder.name, False))
        self.assertIn("Nothing was measured yet.", folder.read("report.md"))

    def test_solved_poses_get_the_stamps_of_their_keyframes_robot_by_robot(self):
        folder = Folder()
        for robot, name, stamps in ((1, "a", (5, 6)), (0, "b", (7,))):
            folder.write(f"run/{name}/summary.json", {"robot": robot})
            folder.write(f"run/{name}/keyframes.csv", "robot,keyframe,stamp_ns,median_depth_m\n" + "".join(
                f"{robot},{k},{stamp},5\n" for k, stamp in enumerate(stamps)))
        folder.write("poses.tum", "0 1 2 3 0 0 0 1\n1 4 5 6 0 0 0 1\n2 7 8 9 0 0 0 1\n")
        tables.write_stamped(folder.path("run"), folder.path("poses.tum"), folder.path("out"))
        self.assertEqual(folder.read("out/b.tum"), "0.000000007 1 2 3 0 0 0 1\n")
        self.assertEqual(folder.read("out/a.tum"),
                         "0.000000005 4 5 6 0 0 0 1\n0.000000006 7 8 9 0 0 0 1\n")

    def test_odometry_is_placed_at_the_first_optimised_keyframe(self):
        folder = Folder()
        half = math.sqrt(0.5)
        folder.write("run/a/summary.json", {"robot": 0})
        folder.write("run/a/odometry.tum", "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n3 2 0 1 0 0 0 1\n")
        # Turned by 90 degrees to the left.
        folder.write("run/a/optimized_keyframes.tum", f"2 5 6 7 0 0 {half} {half}\n")
        tables.write_placed(folder.path("run"), folder.path("out"))
        rows = tables.read_trajectory(folder.path("out/a.tum"))
        for row, position in zip(rows, ((5, 5, 7), (5, 6, 7), (5, 7, 8))):
            self.assertLess(math.dist(row[1], position), 1e-12)
            self.assertAlmostEqual(row[2][3], half)


class Results(unittest.TestCase):
    def checked(self, readme):
        with Folder() as folder:
            path = os.path.join(folder, "README.md")
            with open(path, "w", encoding="utf-8") as file:
                file.write(readme)
            return subprocess.run([sys.executable, os.path.join(EXPERIMENTS, "results.py"), "check", path],
                                  capture_output=True, text=True, check=False)

    def test_the_readme_has_the_measured_numbers(self):
        with open(os.path.join(EXPERIMENTS, "../../../README.md"), encoding="utf-8") as file:
            readme = file.read()
        self.assertEqual(self.checked(readme).returncode, 0)
        begin = readme.index("<!-- results.py table -->")
        digit = next(k for k in range(readme.index(" mm", begin) - 1, 0, -1) if readme[k].isdigit())
        other = readme[:digit] + str((int(readme[digit]) + 1) % 10) + readme[digit + 1:]
        wrong = self.checked(other)
        self.assertEqual(wrong.returncode, 1)
        self.assertIn("not that of results.json", wrong.stderr)


class Commands(unittest.TestCase):
    """Outlier rejection by the real programs."""

    def setUp(self):
        self.folder = Folder()
        self.write_graph()

    def write_graph(self):
        """Twice around a regular polygon: each pose of the second round closes a loop."""
        edge = lambda a, b, x, turn: f"EDGE_SE2 {a} {b} {x} 0 {turn} 100 0 0 100 0 1000\n"
        self.folder.write("graphs/manhattan.g2o", "".join(
            [f"VERTEX_SE2 {k} 0 0 0\n" for k in range(40)]
            + [edge(k - 1, k, 1.0, 2 * math.pi / 20) for k in range(1, 40)]
            + [edge(k, k + 20, 0.0, 0.0) for k in range(20)]))

    def make(self, *arguments):
        variables = {"PROGRAMS": PROGRAMS, "DATA": self.folder.path("data"),
                     "OUTPUT": self.folder.path("results"), "GRAPHS": self.folder.path("graphs"),
                     "pcm_options": "--outliers 30", "PCM_SEEDS": "1 2"}
        done = subprocess.run(
            ["make", "-C", EXPERIMENTS, *(f"{key}={value}" for key, value in variables.items()), *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            env={key: value for key, value in os.environ.items() if not key.startswith("MAKE")})
        return done.returncode, done.stdout

    def test_results_are_made_once_and_again_after_a_change_of_their_inputs(self):
        code, output = self.make("pcm", "report")
        self.assertEqual(code, 0, output)
        self.assertIn("kimera_multi_pgo pcm", output)
        self.assertIn("search of one addition [ms]: batch", self.folder.read("results/report.md"))
        self.assertNotIn("kimera_multi_pgo pcm", self.make("pcm")[1])
        self.write_graph()
        os.utime(self.folder.path("graphs/manhattan.g2o"), (2e9, 2e9))
        self.assertIn("kimera_multi_pgo pcm", self.make("pcm")[1])

    def test_a_failed_step_leaves_no_result_and_an_exit_code(self):
        self.folder.write("graphs/manhattan.g2o", "VERTEX_SE2 0 0 0\n")
        code, output = self.make("pcm")
        self.assertNotEqual(code, 0)
        self.assertIn("manhattan.g2o:1", output)
        self.assertFalse(os.path.exists(self.folder.path("results/pcm-1.json")))

    def test_what_has_no_input_is_left_out_of_all_and_named(self):
        os.remove(self.folder.path("graphs/manhattan.g2o"))
        code, output = self.make("-n", "all")
        self.assertEqual(code, 0, output)
        self.assertIn("left out: pcm: no manhattan.g2o", output)
        self.assertIn("left out: v1 v2", output)
        code, output = self.make("pcm")
        self.assertNotEqual(code, 0)
        self.assertIn("GRAPHS=DIR names its folder", output)

    def test_the_command_alone_explains(self):
        code, output = self.make()
        self.assertEqual(code, 0)
        self.assertIn("make quick", output)


if __name__ == "__main__":
    unittest.main()

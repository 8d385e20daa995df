#pragma once

#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "apps/lab/experiments/report.hpp"
#include "apps/lab/experiments/step_record.hpp"
#include "apps/team/team_report.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {

// A mesh error of which `right` points among `all` have the right label. Errors of the surface that
// robots saw are half as large.
inline MeshError canned_mesh(const std::string& name, double error_m, int right, int all) {
  MeshError mesh;
  mesh.name = name;
  mesh.truth.point.mean_m = error_m;
  mesh.seen.point.mean_m = 0.5 * error_m;
  for (int k = 0; k < all; ++k)
    for (LabelConfusion* labels : {&mesh.truth.labels, &mesh.seen.labels})
      labels->add(1, k < right ? 1 : 2);
  return mesh;
}

inline MeshReport canned_meshes(double error_m, int right, int all) {
  MeshReport report;
  report.has_labels = true;
  for (const char* name : {"robot0", "robot1", "robot2"})
    report.robots.push_back(canned_mesh(name, error_m, right, all));
  report.merged = canned_mesh("merged", error_m, right, all);
  return report;
}

inline TrajectoryError canned_error(const std::string& name, double rmse_m) {
  TrajectoryError error;
  error.name = name;
  error.position_m.count = 1;
  error.position_m.rmse = rmse_m;
  return error;
}

// Small results of every step in City: three robots that drive straight on, 1 m/s.
class CannedCity {
 public:
  explicit CannedCity(bool quick = false) : config_(read_experiments("config/experiments", false)) {
    config_.quick = quick;
    config_.alone.world = "city";
    config_.alone.robot = "robot0";
    for (auto* worlds : {&config_.trajectory_worlds, &config_.resources_worlds,
                         &config_.mesh_worlds, &config_.semantics_worlds})
      *worlds = {"city"};
    config_.level_runs = {{2, kLevelRun}};
    for (const char* recordings : {"city", kLevelRun}) write_recordings(recordings);
    for (const char* run : {"city", "city-run2", "city-run3"}) {
      write_run(run);
      for (const PgoMethodConfig& method : config_.methods) write_method(run, method);
    }
    write_run("city-paper", 0.008);
    write_run(kLevelRun);
    write_trajectories(kLevelRun);
    write_alone();
    config_.cosmo.sets.resize(1);
    write_cosmo();
    for (const unsigned seed : config_.pcm.seeds) write_pcm(seed);
    folder_.write("results/figures/mesh-city-before.png", "\x89PNG before");
    folder_.write("results/figures/mesh-city-after.png", "\x89PNG after");
    write_records();
  }

  ReportSummary report() const { return write_report(config_, paths()); }
  std::string read(const std::string& name) const { return folder_.read("results/" + name); }
  void write(const std::string& name, const std::string& text) const {
    folder_.write("results/" + name, text);
  }
  void forget(const std::string& step) const {
    std::filesystem::remove(folder_.path() / "results/steps" / (step + ".json"));
  }
  void forget_cosmo() const { forget(cosmo_step_name(config_.cosmo.sets[0])); }

 private:
  static constexpr int kKeyframes = 4;
  static constexpr const char* kLevelRun = "level2-city-seed1";

  ExperimentPaths paths() const {
    return {.programs = "/programs",
            .data = folder_.path() / "data",
            .results = folder_.path() / "results",
            .graphs = folder_.path() / "data",
            .euroc = {}};
  }

  // y of robot r at x, not linear in x, so that the three paths are not on one line.
  static double sideways(int robot, int x) { return robot + 0.1 * x * x; }

  void write_recordings(const std::string& world) const {
    folder_.write("data/" + world + "/simulation.json",
                  R"({"complete": true, "parameters": {"resolution": "376x240", "seed": "7"}})");
    std::string team = "robots:\n";
    for (int r = 0; r < 3; ++r) {
      const std::string name = "robot" + std::to_string(r);
      std::ostringstream truth;
      for (int x = 0; x < kKeyframes; ++x)
        truth << x + 1 << "000000000," << x << ',' << sideways(r, x) << ",0,1,0,0,0\n";
      folder_.write("data/" + world + '/' + name + "/truth.csv", truth.str());
      team += "  - {id: " + std::to_string(r) + ", name: " + name + ", dataset: " + name +
              ", truth: " + name + "/truth.csv}\n";
    }
    folder_.write("data/" + world + "/team.yaml", team);
  }

  // Published keyframes have no error, and standard deviations of 0.1 relative to the first one.
  // Odometry is in the frame of each robot, and 10 % too short in x.
  void write_trajectories(const std::string& world) const {
    for (int r = 0; r < 3; ++r) {
      std::ostringstream keyframes, odometry;
      for (int x = 0; x < kKeyframes; ++x) {
        keyframes << x + 1 << ' ' << x << ' ' << sideways(r, x) << " 0 0 0 0 1";
        const char* const variance = r == 0 && x == 0 ? " 1e-12" : " 0.01";
        for (int k = 0; k < 36; ++k) keyframes << (k % 7 == 0 ? variance : " 0");
        keyframes << '\n';
        odometry << x + 1 << ' ' << 0.9 * x << ' ' << sideways(0, x) << " 0 0 0 0 1\n";
      }
      const std::string run = "data/" + world + "_res/robot" + std::to_string(r);
      folder_.write(run + "/optimized_keyframes.tum", keyframes.str());
      folder_.write(run + "/odometry.tum", odometry.str());
    }
  }

  void write_run(const std::string& world, double published_m = 0.006) const {
    TeamResult team;
    team.optimized.emplace().joint = canned_error("team", published_m);
    team.live.emplace().joint = canned_error("team", 1.5 * published_m);
    for (int r = 0; r < 3; ++r) {
      const std::string name = "robot" + std::to_string(r);
      const std::string run = "data/" + world + "_res/" + name;
      std::string keyframes = "robot,keyframe,stamp_ns,median_depth_m\n";
      for (int x = 0; x < kKeyframes; ++x)
        keyframes += std::to_string(r) + ',' + std::to_string(x) + ',' + std::to_string(x + 1) +
                     "000000000,5\n";
      folder_.write(run + "/keyframes.csv", keyframes);
      RunSummary summary;
      summary.keyframes = kKeyframes;
      summary.keypoints = 1000 * kKeyframes;
      summary.peer_keyframes = {.keyframes = 2, .keypoints = 400};
      summary.traffic = {
          {"place_recognition", 1000000}, {"geometric_verification", 2000000}, {"pgo", 9000000}};
      summary.process.cpu_s = 2.4;
      summary.process.peak_memory_bytes = 250000000;
      folder_.write(run + "/summary.json", json_text(summary));
      folder_.write(run + "/timing.csv",
                    "module,calls,median_ms,p95_ms,max_ms,total_s\nvio,3,1,1,1,1.2\n");
      folder_.write(run + "/pose_graph.g2o", "");
      RobotResult& robot = team.robots.emplace_back();
      robot.plan.name = name;
      robot.summary = summary;
      robot.odometry = canned_error(name, 0.0123);
      team.optimized->robots.push_back(canned_error(name, 0.0045));
    }
    team.closures.emplace();
    team.closures->inliers.judged = 817;
    team.closures->inliers.correct = 816;
    team.closures->by_angle[2] = {.true_pairs = 10, .pairs_found = 4};
    team.meshes.errors = MeshChange{canned_meshes(0.08, 9, 10), canned_meshes(0.06, 19, 20)};
    folder_.write("results/team-" + world + ".json", json_text(team));
  }

  // Poses with an error that no rigid motion removes: local PGO has the most, RBCD half of it, all
  // others none. The further runs have less.
  void write_method(const std::string& world, const PgoMethodConfig& method) const {
    const double share = world == "city" ? 1.0 : world == "city-run2" ? 0.9 : 0.8;
    const double bend_m = method.name == "local" ? share : method.name == "rbcd" ? 0.5 : 0.0;
    std::ostringstream poses;
    for (int i = 0; i < 3 * kKeyframes; ++i) {
      const int r = i / kKeyframes, x = i % kKeyframes;
      poses << i << ' ' << x << ' ' << sideways(r, x) + (x == 0 || x == 3 ? bend_m : -bend_m)
            << " 0 0 0 0 1\n";
    }
    folder_.write("results/poses/pgo-" + world + '-' + method.name + ".tum", poses.str());
    const double cost = method.name == "rbcd" ? 1060.0 : 1000.0;
    std::ostringstream json;
    json << R"({"poses": 12, "edges": 34, "rounds": [{"round": 0, "cost": 2000, "bytes": 0},
             {"round": 5, "cost": 1000, "bytes": 4321000, "critical_path_s": 0.125},
             {"round": 7, "cost": 1000, "bytes": 5000000, "critical_path_s": 0.5}])";
    if (method.name == "newton")
      json << R"(, "decided": true})";
    else
      json << R"(, "rounded_cost": )" << cost << R"(, "optimum": 1000.0})";
    folder_.write("results/pgo-" + world + '-' + method.name + ".json", json.str());
  }

  void write_alone() const {
    RunSummary summary;
    summary.process.cpu_s = 0.6;
    summary.process.peak_memory_bytes = 120000000;
    folder_.write("data/city_alone/summary.json", json_text(summary));
    folder_.write("data/city_alone/timing.csv",
                  "module,calls,median_ms,p95_ms,max_ms,total_s\nvio,3,1,1,1,0.3\n"
                  "sensors,3,1,1,1,0.1\n");
    folder_.write("data/city_alone/odometry.tum", "1 0 0 0 0 0 0 1\n4 3 0 0 0 0 0 1\n");
  }

  // On the first set, for which 1.77 m were published.
  void write_cosmo() const {
    const auto counts = [](int false_kept) {
      return Json{{"true_kept", 99},
                  {"true_lost", 1},
                  {"false_kept", false_kept},
                  {"false_rejected", 20 - false_kept}};
    };
    const Json result = {
        {"poses", 1604},
        {"rounds", {{{"cost", 9.0}}, {{"round", 1}, {"cost", 8.0}, {"critical_path_s", 0.25}}}},
        {"closures", {{"inside", counts(0)}, {"between", counts(2)}}},
        {"ate", {{"team_m", 1.5}}},
        {"optimum_of_true", {{"team_m", 2.0}}},
        {"ate_ratio", 0.75}};
    folder_.write("results/" + cosmo_step_name(config_.cosmo.sets[0]) + ".json", json_text(result));
  }

  // Batch takes 4, 8, 12 times as long as the others.
  void write_pcm(unsigned seed) const {
    std::ostringstream runs;
    for (const std::string search : {"batch", "incremental", "exact"}) {
      runs << (search == "batch" ? "[" : ", ") << "{\"search\": \"" << search
           << "\", \"additions\": [";
      for (int k = 1; k <= 120; ++k)
        runs << (k == 1 ? "" : ", ")
             << "{\"search_s\": " << (search == "batch" ? 0.004 * seed : 0.001)
             << ", \"clique\": " << k << '}';
      runs << "]}";
    }
    runs << ']';
    const std::string name = "pcm-" + std::to_string(seed);
    folder_.write("results/" + name + ".json", runs.str());
    folder_.write("results/figures/" + name + ".html", "<!doctype html>");
  }

  void write_records() const {
    std::vector<std::string> names;
    for (const ExperimentName& experiment : kExperiments) names.emplace_back(experiment.name);
    for (const Step& step : plan_experiments(names, config_, paths()))
      write_record(paths().results, {.step = step.name,
                                     .fingerprint = fingerprint_of(step),
                                     .command = step.command,
                                     .started = "2026-01-01 00:00 UTC",
                                     .seconds = 12.5,
                                     .commit = "abc123",
                                     .machine = {"TestChip", 2, 8.0, 0.5}});
  }

  TemporaryFolder folder_;
  ExperimentConfig config_;
};

}  // namespace km

#include <catch2/catch.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "apps/experiments/report.hpp"
#include "apps/experiments/step_record.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

using Catch::Contains;

constexpr const char* kLabels = R"("labels": {"accuracy": )";

// A mesh of whom everything is said by two numbers.
std::string mesh(double error_m, double accuracy) {
  std::ostringstream text;
  text << R"({"truth_to_estimate": {"point": {"mean_m": )" << error_m << "}, " << kLabels
       << accuracy << R"(}}, "seen_truth_to_estimate": {"point": {"mean_m": )" << 0.5 * error_m
       << "}, " << kLabels << accuracy << "}}}";
  return text.str();
}

std::string meshes(double error_m, double accuracy) {
  const std::string own = mesh(error_m, accuracy);
  std::string robots;
  for (const char* name : {"robot0", "robot1", "robot2"})
    robots +=
        (robots.empty() ? "" : ", ") + std::string("{\"name\": \"") + name + "\", " + own.substr(1);
  return "{\"robots\": [" + robots + "], \"merged\": " + own + '}';
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
    write_recordings();
    for (const char* run : {"city", "city-run2", "city-run3"}) {
      write_run(run);
      for (const PgoMethodConfig& method : config_.methods) write_method(run, method);
    }
    write_alone();
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

 private:
  static constexpr int kKeyframes = 4;

  ExperimentPaths paths() const {
    return {.programs = "/programs",
            .data = folder_.path() / "data",
            .results = folder_.path() / "results",
            .graphs = folder_.path() / "data",
            .euroc = {}};
  }

  // y of robot r at x, so that the three paths are not on one line.
  static double sideways(int robot, int x) { return robot + 0.1 * x * x; }

  void write_recordings() const {
    folder_.write("data/city/simulation.json",
                  R"({"complete": true, "parameters": {"resolution": "376x240", "seed": "7"}})");
    std::string team = "robots:\n";
    for (int r = 0; r < 3; ++r) {
      const std::string name = "robot" + std::to_string(r);
      std::ostringstream truth;
      for (int x = 0; x < kKeyframes; ++x)
        truth << x + 1 << "000000000," << x << ',' << sideways(r, x) << ",0,1,0,0,0\n";
      folder_.write("data/city/" + name + "/truth.csv", truth.str());
      team += "  - {id: " + std::to_string(r) + ", name: " + name + ", dataset: " + name +
              ", truth: " + name + "/truth.csv}\n";
    }
    folder_.write("data/city/team.yaml", team);
  }

  void write_run(const std::string& world) const {
    std::string robots, optimized;
    for (int r = 0; r < 3; ++r) {
      const std::string name = "robot" + std::to_string(r);
      const std::string run = "data/" + world + "_res/" + name;
      std::string keyframes = "robot,keyframe,stamp_ns,median_depth_m\n";
      for (int x = 0; x < kKeyframes; ++x)
        keyframes += std::to_string(r) + ',' + std::to_string(x) + ',' + std::to_string(x + 1) +
                     "000000000,5\n";
      folder_.write(run + "/keyframes.csv", keyframes);
      folder_.write(run + "/summary.json",
                    R"({"process": {"cpu_s": 2.4, "peak_memory_bytes": 250000000}})");
      folder_.write(run + "/traffic.csv",
                    "time_s,direction,topic,category,peer,messages,bytes,retransmitted_bytes\n"
                    "1,out,keyframe_replies,geometric_verification,1,1,30000,0\n"
                    "2,out,keyframe_replies,geometric_verification,1,2,80000,0\n");
      folder_.write(run + "/timing.csv",
                    "module,calls,median_ms,p95_ms,max_ms,total_s\nvio,3,1,1,1,1.2\n");
      folder_.write(run + "/pose_graph.g2o", "");
      robots += (r == 0 ? "" : ", ") + std::string("{\"name\": \"") + name +
                R"(", "keyframes": 4, "traffic": {"place_recognition": 1000000,
                "geometric_verification": 2000000, "pgo": 9000000},
                "odometry": {"position_m": {"rmse": 0.0123}}})";
      optimized += (r == 0 ? "" : ", ") + std::string("{\"name\": \"") + name +
                   R"(", "position_m": {"rmse": 0.0045}})";
    }
    folder_.write(
        "results/team-" + world + ".json",
        "{\"robots\": [" + robots + "], \"optimized\": {\"robots\": [" + optimized +
            "], \"joint\": {\"position_m\": {\"rmse\": 0.006}}}, \"closures\": {\"inliers\": "
            "{\"judged\": 817, \"correct\": 816}}, \"meshes\": " +
            meshes(0.08, 0.9) + ", \"optimized_meshes\": " + meshes(0.06, 0.95) + '}');
  }

  // Poses bent off the truth: local PGO the most, RBCD half of it, all others not at all.
  // The further runs bend less.
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
    json << R"({"poses": 12, "edges": 34, "rounds": [{"cost": 2000, "bytes": 0},
             {"cost": 1000, "bytes": 4321000,
             "critical_path_s": 0.125}], "rounded_cost": )"
         << cost << R"(, "optimum": 1000.0})";
    folder_.write("results/pgo-" + world + '-' + method.name + ".json", json.str());
  }

  void write_alone() const {
    folder_.write("data/city_alone/summary.json",
                  R"({"process": {"cpu_s": 0.6, "peak_memory_bytes": 120000000}})");
    folder_.write("data/city_alone/timing.csv",
                  "module,calls,median_ms,p95_ms,max_ms,total_s\nvio,3,1,1,1,0.3\n"
                  "sensors,3,1,1,1,0.1\n");
    folder_.write("data/city_alone/odometry.tum", "1 0 0 0 0 0 0 1\n4 3 0 0 0 0 0 1\n");
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
    folder_.write("results/figures/" + name + ".svg",
                  "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"9\" height=\"9\"></svg>");
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

// Every element of a page that is written as XML is closed, in order; styles and the first line
// are left out.
bool is_balanced(const std::string& page) {
  std::vector<std::string> open;
  for (std::size_t at = page.find('<'); at != page.npos; at = page.find('<', at + 1)) {
    const std::size_t end = page.find('>', at);
    if (end == page.npos) return false;
    if (page[at + 1] == '!') continue;
    const bool closing = page[at + 1] == '/';
    const std::size_t name_at = at + (closing ? 2 : 1);
    const std::string name = page.substr(name_at, page.find_first_of(" />\n", name_at) - name_at);
    if (closing) {
      if (open.empty() || open.back() != name) return false;
      open.pop_back();
    } else if (page[end - 1] != '/') {
      open.push_back(name);
    }
  }
  return open.empty();
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != text.npos; at = text.find(what, at + 1)) ++n;
  return n;
}

TEST_CASE("The report has every table with our values and the paper's", "[experiments]") {
  const CannedCity city;
  const ReportSummary summary = city.report();
  CHECK(summary.targets > 8);
  CHECK(summary.met < summary.targets);
  const std::string text = city.read("report.md");
  CHECK_THAT(text, Contains("Table I: absolute trajectory error") && Contains("Table I: cost") &&
                       Contains("Table II: communication") &&
                       Contains("Table II: rounds and seconds") && Contains("Fig. 7 as numbers") &&
                       Contains("Table III") && Contains("Fig. 5 as numbers") &&
                       Contains("Numbers to reach"));
  // Costs 1060 over 1000 in their cells beside the paper's, and the gap between them.
  CHECK_THAT(text, Contains("1060.0 (1113.1)") && Contains("| 6.0 (6.3) |"));
  // No motion as a whole comes nearer to such a bend: it is the whole error; half of it is less
  // than the paper's share.
  CHECK_THAT(text, Contains("1.00 (6.09)") && Contains("0.500 (2.38)"));
  CHECK_THAT(text, Contains("| ATE of RBCD over that of local PGO | City | at most 0.39, the "
                            "paper's | **0.50** |"));
  // 12 keyframes of 40 kB; 3 + 6 + 4.321 MB sent.
  CHECK_THAT(text, Contains("| 12 (3238) | 34 (3428) | 3.00 (16.43) | 6.00 (36.80) | 4.32 (4.27) | "
                            "13.32 (57.50) | 2.2 (1989.4) | 0.48 (149.48) | 2775 (38) |"));
  CHECK_THAT(text, Contains("| 1 (500) | 0.125 (34.90) |"));
  CHECK_THAT(text, Contains("| City, merged | 8.00 | **6.00** | 4.00 | **3.00** |"));
  CHECK_THAT(text, Contains("| City, merged | 90.00 (67.91) | **95.00** (83.93) |"));
  CHECK_THAT(text, Contains("| robot0, odometry alone | no | 3 | 0.6 | 0.20 | 120 |") &&
                       Contains("| City, robot0 | no | 3 | 2.4 | 0.80 | 250 |") &&
                       Contains("| vio | 75.0 | 100.0 |"));
  CHECK_THAT(text, Contains("`kimera_multi_pgo ") &&
                       Contains("All on TestChip, 2 cores, 8 GB; commit abc123.") &&
                       Contains("`kimera_multi_pgo RESULTS/graphs/city --method local --json ") &&
                       Contains("12.5 s, load 0.5"));
}

TEST_CASE("Several runs and seeds are shown by median and range", "[experiments]") {
  const CannedCity city;
  (void)city.report();
  const std::string text = city.read("report.md");
  CHECK_THAT(text,
             Contains("| City | 3 | 0.9000 (0.8000 to 1.0000) | 0.5000 (0.5000 to 0.5000) |"));
  CHECK_THAT(text, Contains("| City | 3 | 3.00 (3.00 to 3.00) | 6.00 (6.00 to 6.00) | 27.00 "));
  CHECK_THAT(text, Contains("| 120 | 8.000 (4.000 to 12.000) | 1.000 (1.000 to 1.000) |"));
  CHECK_THAT(text, Contains("3 seeds, the worst | faster | **4.0 times as fast** |"));
}

TEST_CASE("What all solves of a run sent is judged beside the one of the paper", "[experiments]") {
  const CannedCity city;
  (void)city.report();
  // 36 MB over 12 keyframes of 40 kB.
  CHECK_THAT(
      city.read("report.md"),
      Contains("keypoints sent, one solve, as the paper counts | City | at most 38 %, aim 10 % | "
               "**2775 %** |") &&
          Contains("keypoints sent, all solves of the run | City | at most 38 % | **7500 %** |"));
}

TEST_CASE("A robot that never met the others is named", "[experiments]") {
  const CannedCity city;
  const std::string team = city.read("team-city.json");
  const std::string name = "\"name\": \"robot2\"";
  std::string apart = team;
  apart.insert(apart.find(name), "\"in_team_frame\": false, ");
  city.write("team-city.json", apart);
  (void)city.report();
  CHECK_THAT(city.read("report.md"), Contains("City: robot2 never met the others;"));
}

TEST_CASE("Small versions are judged only by what they can answer", "[experiments]") {
  const CannedCity city(true);
  const ReportSummary summary = city.report();
  CHECK(summary.targets == 6);  // two costs, two searches with time and clique
  CHECK(summary.met == 6);
  const std::string text = city.read("report.md");
  CHECK_THAT(text, Contains("6 of 6 are met.") && Contains("Not judged: inputs of full size") &&
                       Contains("| ATE of RBCD over that of local PGO | City | at most 0.39, the "
                                "paper's | 0.50 |") &&
                       !Contains("**Missed**"));
}

TEST_CASE("The page stands alone and is well formed", "[experiments]") {
  const CannedCity city;
  (void)city.report();
  const std::string page = city.read("report.html");
  CHECK(is_balanced(page));
  const std::size_t namespaces = count(page, "xmlns=\"http://www.w3.org/2000/svg\"");
  CHECK(namespaces >= 4);  // of outlier rejection, two trajectories, mesh errors
  CHECK(count(page, "http") == namespaces);
  CHECK(count(page, "data:image/png;base64,") == 2);
  for (const char* id :
       {"targets", "pcm", "trajectory", "resources", "mesh", "semantics", "origin"}) {
    CAPTURE(id);
    CHECK_THAT(page, Contains("<section id=\"" + std::string(id) + "\">") &&
                         Contains("<a href=\"#" + std::string(id) + "\">"));
  }
  CHECK_THAT(page, Contains("<td>1060.0<span class=\"paper\">1113.1</span></td>"));
  CHECK_THAT(city.read("numbers.json"), Contains("\"paper\": \"1113.1\""));
}

TEST_CASE("Without results the report says so", "[experiments]") {
  const CannedCity city;
  city.forget("pgo-city-rbcd");
  for (const char* step : {"pcm-1", "pcm-2", "pcm-3"}) city.forget(step);
  (void)city.report();
  std::string text = city.read("report.md");
  CHECK_THAT(text, !Contains("1060.0 (1113.1)") && Contains("- (1113.1)") &&
                       !Contains("Outlier rejection") && Contains("Not run so far: pcm.") &&
                       Contains("Not done: pcm-1, pcm-2, pcm-3 (no pose graph ") &&
                       Contains("Not done: pgo-city-rbcd (not run, or not up to date)."));
  for (const char* step : {"team-city", "alone-city"}) city.forget(step);
  (void)city.report();
  text = city.read("report.md");
  CHECK_THAT(text, !Contains("Table I:") && !Contains("Table III") && !Contains("## Meshes") &&
                       Contains("Nothing was measured yet."));
}

}  // namespace
}  // namespace km

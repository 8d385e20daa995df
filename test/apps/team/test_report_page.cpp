#include <nlohmann/json.hpp>

#include "apps/team/report_page.hpp"
#include "test/apps/viewer/page_programs.hpp"
#include "test/apps/viewer/small_run.hpp"
#include "test/support/command.hpp"
#include "test/support/page_text.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// SmallRun as kimera_multi_team ran it. Robot r0 drove 10 m along x, by its truth and by its
// `optimized` poses; r1 is 3 m beside it. r0 has a finding.
struct ReportedRun {
  SmallRun run;
  TeamPlan plan;

  ReportedRun() {
    plan.output = run.folder.path();
    for (const RobotId id : {RobotId{0}, RobotId{1}}) {
      RobotPlan& robot = plan.robots.emplace_back();
      robot.id = id;
      robot.name = "r" + std::to_string(id);
      robot.graph = "g.csv";
    }
    const auto file = plan.output / "r0/summary.json";
    RunSummary summary = read_summary(file);
    summary.exit_reason = kHostileText;
    summary.findings = {{"closures.few", Severity::kWarning, kHostileText, "it follows", "look"}};
    write_summary(file, summary);
  }

  // The true poses of both in one world, turned by a quarter about z.
  void know_truth() {
    for (RobotPlan& robot : plan.robots) {
      std::string text;
      for (int i = 0; i <= 100; ++i)
        text += std::to_string(500.0 + 0.1 * i) + ' ' + std::to_string(-3.0 * robot.id) + ' ' +
                std::to_string(0.1 * i) + " 0 0 0 0.70710678 0.70710678\n";
      robot.truth = run.folder.write(robot.name + "_truth.tum", text);
    }
  }

  [[nodiscard]] TeamResult collect() const {
    return collect_results(plan, std::vector<RobotRun>(plan.robots.size()));
  }
  [[nodiscard]] Json data() const { return report_data(plan, collect()); }
};

}  // namespace

TEST_CASE("The report has the numbers that the robots left") {
  const Json data = ReportedRun().data();
  REQUIRE(data["robots"].size() == 2);
  const Json& robot = data["robots"][0];
  CHECK(robot["name"] == "r0");
  REQUIRE(robot["optimized"].size() == 101);
  CHECK(robot["optimized"][50] == Json::parse("[5, 0, 5]"));
  CHECK(data["robots"][1]["optimized"][50] == Json::parse("[5, 3, 5]"));
  CHECK(robot["truth"].empty());
  CHECK(robot["optimized_error"].empty());
  CHECK(robot["keyframes"] == Json::parse("[[0, 0, 0], [1, 4, 0], [2, 8, 0]]"));
  CHECK(robot["rounds"] == Json::parse("[[1, 5], [2, 7]]"));
  CHECK(robot["sent"] == Json::parse(R"({"pgo": [[2, 100], [6, 255]]})"));
  CHECK(robot["process"].size() == 12);
  CHECK(robot["process"][1] == Json::parse("[2, 1, 1e8]"));
  CHECK(robot["timing"] == Json::parse(R"([["vio", 9, 1, 1, 1, 3]])"));
  REQUIRE(robot["closures"].size() == 2);
  CHECK(robot["closures"][0] == Json::parse("[0, 0, 1, 1, 4, 80, 60, 0]"));
  CHECK(robot["closures"][1] == Json::parse("[0, 1, 1, 2, 2, 9, 0, 1]"));
  CHECK(data["reasons"] == Json::parse(R"(["", "no pose"])"));
  CHECK(data["team"]["robots"][0]["findings"][0]["id"] == "closures.few");
  CHECK_THAT(data["map"].get<std::string>(), StartsWith("data:image/jpeg;base64,"));
}

TEST_CASE("If there is a truth, the report has it and the error over time") {
  constexpr double kRounded_m = 2e-3, kExact_m = 1e-6;
  ReportedRun reported;
  reported.know_truth();
  const Json data = reported.data();
  for (const Json& robot : data["robots"]) {
    CAPTURE(robot["name"]);
    REQUIRE(robot["truth"].size() == 101);
    REQUIRE(robot["optimized_error"].size() == 101);
    REQUIRE(robot["odometry_error"].size() == 101);
    for (int i = 0; i <= 100; ++i) {
      CHECK(robot["optimized_error"][i][0] == Approx(0.1 * i));
      CHECK(robot["optimized_error"][i][1].get<double>() < kExact_m);
      // In the world of the truth, where the robots drove along y.
      CHECK(robot["optimized"][i][0].get<double>() ==
            Approx(-3.0 * robot["id"].get<int>()).margin(kRounded_m));
      CHECK(robot["optimized"][i][1].get<double>() == Approx(0.1 * i).margin(kRounded_m));
    }
  }
}

TEST_CASE("Lines are interrupted at missing poses, not between rare keyframes") {
  ReportedRun reported;
  reported.know_truth();
  const auto write = [&](const char* file, const std::vector<double>& times_s) {
    std::string poses;
    for (const double t : times_s) poses += std::to_string(t) + " 1 0 0 0 0 0 1\n";
    reported.run.folder.write(file, poses);
  };
  std::vector<double> images_s{500.0, 500.1, 500.2};
  for (int i = 0; i <= 80; ++i) images_s.push_back(502.0 + 0.1 * i);
  write("r0/odometry.tum", images_s);
  write("r0/optimized.tum", {500.0, 500.1, 500.2, 502.2, 506.0, 509.9});
  const Json robot = reported.data()["robots"][0];
  const auto breaks = [&](const char* line) {
    std::vector<std::size_t> at;
    for (std::size_t i = 0; i < robot[line].size(); ++i)
      if (robot[line][i][0].is_null()) at.push_back(i);
    return at;
  };
  for (const char* line : {"odometry", "odometry_error", "optimized", "optimized_error"}) {
    CAPTURE(line);
    CHECK(breaks(line) == std::vector<std::size_t>{3});
  }
  CHECK(robot["optimized"][3] == Json::parse("[null, null, null]"));
  CHECK(robot["optimized_error"][3] == Json::parse("[null, null]"));
  CHECK(breaks("truth").empty());
}

TEST_CASE("Long series are thinned, with both ends") {
  const ReportedRun reported;
  std::string rounds = "seconds,round,members,cost,gradient_norm\n";
  for (int i = 1; i <= 10000; ++i) rounds += "0," + std::to_string(i) + ",2,3,0.1\n";
  reported.run.folder.write("r0/optimizer.csv", rounds);
  const Json points = reported.data()["robots"][0]["rounds"];
  CHECK(points.size() > 1000);
  CHECK(points.size() <= 1502);
  CHECK(points.front()[0] == 1);
  CHECK(points.back()[0] == 10000);
}

TEST_CASE("A table that cannot be used is a note of the report, a missing one none") {
  const ReportedRun reported;
  reported.run.folder.write("r1/traffic.csv", "time_s\nsoon,out\n");
  fs::remove(reported.plan.output / "r1/optimizer.csv");
  const Json data = reported.data();
  CHECK(data["robots"][1]["sent"].empty());
  CHECK(data["robots"][1]["rounds"].empty());
  REQUIRE(data["notes"].size() == 1);
  CHECK_THAT(data["notes"][0].get<std::string>(), Contains("r1/traffic.csv line 2"));
}

TEST_CASE("The report needs no other file and no network, and shows text as it is") {
  const std::string page = report_page(ReportedRun().data());
  CHECK(references_of_page(page) == 0);
  CHECK(data_of_page(page, "run")["team"]["robots"][0]["exit_reason"] == kHostileText);
}

TEST_CASE("The report opens in a browser and shows its charts", "[slow]") {
  if (const std::string why = missing_page_program(); !why.empty()) {
    std::cout << "SKIPPED: " << why << '\n';
    return;
  }
  ReportedRun reported;
  reported.know_truth();
  Json data = reported.data();
  CHECK(data["images"].empty());  // pose graphs have none
  for (const char* keyframe : {"0:0", "1:1", "0:1"})
    data["images"][keyframe] = "data:image/gif;base64,R0lGODlhAQABAAAAACwAAAAAAQABAAA=";
  const auto page = reported.run.folder.write("with_images.html", report_page(data));
  const CommandResult result =
      run_command("node test/apps/team/report_in_browser.mjs " + page.string());
  INFO(result.output);
  CHECK(result.exit_code == 0);
}

}  // namespace km

#include <nlohmann/json.hpp>

#include "apps/lab/pgo/truth_score.hpp"
#include "test/support/command.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/small_jrl.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const std::string kPgoTool = KM_BIN_DIR "/kimera_multi_pgo ";

LabelledTeamGraph small_team() {
  return labelled_team(parse_jrl(SmallJrl().text(), "small.jrl"), "small.jrl");
}

// The true poses of the small team, each position multiplied by `scale`, in a frame of its own.
SolvedPart scaled_truth(const LabelledTeamGraph& team, double scale) {
  const SE3 T_world_truth =
      make_pose(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX()).toRotationMatrix(), {5, -3, 2});
  SolvedPart part;
  for (const auto& T : team.truth.T_world_kf) {
    part.poses.push_back(part.poses.size());
    part.T_world_kf.push_back(T_world_truth * make_pose(T->linear(), scale * T->translation()));
  }
  return part;
}

}  // namespace

TEST_CASE("A JRL file becomes a team with its labels and poses") {
  const LabelledTeamGraph team = small_team();
  CHECK(team.graph.robots() == 2);
  CHECK(team.graph.first == std::vector<Eigen::Index>{0, 3, 5});
  REQUIRE(team.graph.edges.size() == 6);
  CHECK(team.truth.is_false == std::vector<bool>{false, false, false, false, false, true});
  CHECK(team.graph.edges[3].i == 4);
  CHECK(team.graph.edges[3].j == 1);
  CHECK(team.graph.edges[3].kappa == Approx(1.0 / (2.0 * 1e-4)));  // kappa = 3 / (2 tr Sigma_R)
  CHECK(team.graph.edges[3].tau == Approx(1.0 / 1e-2));            // tau = 3 / tr Sigma_t
  CHECK(team.truth.T_world_kf[4]->translation() == Eigen::Vector3d(1, 2, 0));
  CHECK(team.priors == 2);
  CHECK(team.repeated == 1);
}

TEST_CASE("Closures are counted by label, ends and decision") {
  const LabelledTeamGraph team = small_team();
  const auto counts = [&](bool kept) {
    return count_closures(team.graph, team.truth.is_false, std::vector<bool>(6, kept));
  };
  const LabelCounts kept = counts(true);
  CHECK(kept.inside.true_kept == 1);
  CHECK(kept.between.true_kept == 1);
  CHECK(kept.between.false_kept == 1);
  const LabelCounts lost = counts(false);
  CHECK(lost.inside.true_lost == 1);
  CHECK(lost.between.true_lost == 1);
  CHECK(lost.between.false_rejected == 1);
  CHECK(lost.inside.true_kept + lost.between.true_kept + lost.between.false_kept == 0);
}

TEST_CASE("The ATE of positions scaled by 1.1 equals its closed form") {
  const LabelledTeamGraph team = small_team();
  CHECK(ate_of(team, {scaled_truth(team, 1.0)}).team_m == Approx(0.0).margin(1e-12));
  const TeamAte ate = ate_of(team, {scaled_truth(team, 1.1)});
  // Positions (0, 0), (1, 0), (2, 0) of a and (0, 2), (1, 2) of b: means (0.8, 0.8), (1, 0), (0.5,
  // 2).
  const double from_mean = 0.64 + 0.04 + 1.44 + 0.64 + 0.04 + 3 * 0.64 + 2 * 1.44;
  CHECK(ate.team_m == Approx(0.1 * std::sqrt(from_mean / 5.0)));
  CHECK(ate.parts == 1);
}

TEST_CASE("Each part is aligned separately, and poses without truth do not count") {
  LabelledTeamGraph team = small_team();
  const SolvedPart whole = scaled_truth(team, 1.1);
  const auto slice = [&](std::size_t begin, std::size_t end) {
    SolvedPart part;
    for (std::size_t i = begin; i < end; ++i) {
      part.poses.push_back(i);
      part.T_world_kf.push_back(whole.T_world_kf[i]);
    }
    return part;
  };
  const TeamAte ate = ate_of(team, {slice(0, 3), slice(3, 5)});
  CHECK(ate.parts == 2);
  CHECK(ate.team_m == Approx(0.1 * std::sqrt((2.0 + 0.5) / 5.0)));
  team.truth.T_world_kf[3] = team.truth.T_world_kf[4] = std::nullopt;
  CHECK(ate_of(team, {whole}).team_m == Approx(0.1 * std::sqrt(2.0 / 3.0)));
}

TEST_CASE("Without the edges between two robots a team's graph has two parts") {
  const LabelledTeamGraph team = small_team();
  const std::vector<ConnectedPart> parts =
      connected_parts(team.graph, {true, true, true, false, true, false});
  REQUIRE(parts.size() == 2);
  CHECK(parts[0].graph.robots() == 1);
  CHECK(parts[0].poses == std::vector<std::size_t>{0, 1, 2});
  CHECK(parts[0].edges == std::vector<std::size_t>{0, 1, 2});
  CHECK(parts[1].poses == std::vector<std::size_t>{3, 4});
  CHECK(parts[1].graph.ids[1] == KeyframeId{1, 1});
  REQUIRE(parts[1].graph.edges.size() == 1);
  CHECK(parts[1].graph.edges[0].i == 0);
  CHECK(parts[1].graph.edges[0].j == 1);
}

TEST_CASE("solve compares its result with the ground truth of a JRL file") {
  const TemporaryFolder folder;
  const auto file = folder.write("small.jrl", SmallJrl().text());
  const CommandResult result = succeeded(run_command(
      kPgoTool + "solve " + file.string() + " --json " + (folder.path() / "out.json").string()));
  CHECK_THAT(result.output, Contains("5 poses, 6 edges, 2 robots") &&
                                Contains("left out: 2 priors, 1 exact copies") &&
                                Contains("closures") && Contains("inside a robot") &&
                                Contains("; of the optimum of the true closures 0.000 m"));
  const auto json = nlohmann::json::parse(folder.read("out.json"));
  CHECK(json["closures"]["inside"]["true_kept"] == 1);
  CHECK(json["optimum_of_true"]["certified"] == true);
  CHECK(json["optimum_of_true"]["team_m"].get<double>() < 1e-6);
  CHECK(json.contains("ate_ratio"));

  SmallJrl unlabelled;
  unlabelled.document.erase("outlier_factors");
  unlabelled.document.erase("groundtruth");
  (void)folder.write("small.jrl", unlabelled.text());
  const CommandResult plain = run_command(kPgoTool + "solve " + file.string());
  CHECK(plain.exit_code == 0);
  CHECK_THAT(plain.output, !Contains("ATE") && !Contains("true kept"));
}

TEST_CASE("solve refuses a number of robots that a JRL file does not have") {
  const TemporaryFolder folder;
  const auto file = folder.write("small.jrl", SmallJrl().text());
  const CommandResult result = run_command(kPgoTool + "solve " + file.string() + " --robots 3");
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.output, Contains("--robots 3: there are 2 robots"));
}

TEST_CASE("outliers leaves out the closures that a JRL file labels as false") {
  const TemporaryFolder folder;
  const auto file = folder.write("small.jrl", SmallJrl().text());
  const CommandResult result = succeeded(
      run_command(kPgoTool + "outliers " + file.string() + " --shares 100 --methods trust-all"));
  CHECK_THAT(result.output, Contains("5 poses, 2 robots"));
}

TEST_CASE("True closures of COSMO-Bench lead to their known errors") {
  struct Set {
    const char* name;
    double ate_m;  // error of the certified optimum with the weights of robots, rounded to 1 cm
  };
  const Set set = GENERATE(
      Set{"kth_r3_00_d06_d09_d10_wifi", 1.90}, Set{"kth_r3_00_d06_d09_d10_proradio", 1.24},
      Set{"ntu_r3_02_d02_n04_n13_wifi", 2.48}, Set{"ntu_r3_02_d02_n04_n13_proradio", 2.81});
  const auto file = shared_data(std::string("cosmo_bench/") + set.name + ".jrl");
  if (!file) return;
  CAPTURE(set.name);
  const LabelledTeamGraph team = labelled_team(read_jrl(*file), file->string());
  const TrueOptimum optimum = optimum_of_true(team);
  CHECK(optimum.certified);
  const TeamAte ate = ate_of(team, optimum.parts);
  CHECK(ate.parts == 1);
  CHECK(ate.team_m == Approx(set.ate_m).margin(0.006));
}

}  // namespace km

#include "apps/lab/pgo/commands.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "modules/core/io/input_file.hpp"

namespace km {

void GraphInput::define(CLI::App& app) {
  app.add_option(
         "FILE", file,
         "Pose graph (*.g2o), a team's (*.jrl), or a folder with one file per robot, or a team's\n"
         "results")
      ->required();
  app.add_option("--robots", robots, "Number of robots among which a single file is divided")
      ->check(CLI::Range(1, 65535))
      ->each([this](const std::string&) { robots_given = true; });
  app.add_flag("--keep-steps", keep_steps,
               "Keep the odometry between two robots that a cut leaves. The default is without:\n"
               "closures alone join robots in the field");
}

LabelledTeamGraph GraphInput::read() const {
  const bool folder = is_folder(file);
  const bool of_a_team = folder || file.extension() == ".jrl";
  LabelledTeamGraph team =
      folder ? LabelledTeamGraph{read_team_folder(file)}
      : of_a_team
          ? labelled_team(read_jrl(file), file.string())
          : LabelledTeamGraph{partition_contiguously(read_g2o(file), robots, file.string())};
  if (robots_given && team.graph.robots() != robots)
    throw std::runtime_error("--robots " + std::to_string(robots) + ": there are " +
                             std::to_string(team.graph.robots()) + " robots in the file or folder");
  if (keep_steps || of_a_team) return team;
  team.graph = without_cut_steps(std::move(team.graph));
  const std::vector<Eigen::Index> part = part_of_poses(team.graph);
  const auto apart = std::ranges::find_if(part, [](Eigen::Index lowest) { return lowest != 0; });
  if (apart != part.end())
    throw std::runtime_error(file.string() + ": no closures join robot " +
                             std::to_string(team.graph.robot_of(apart - part.begin())) +
                             " to robot 0. --keep-steps keeps the odometry between them");
  return team;
}

std::string indefinite_text(std::size_t edges) {
  if (edges == 0) return {};
  return std::to_string(edges) +
         " edges have an information matrix that is not positive definite: weighed by its blocks, "
         "as SE-Sync does\n";
}

std::string left_out_text(const LabelledTeamGraph& team) {
  if (team.priors + team.repeated == 0) return {};
  return "left out: " + std::to_string(team.priors) + " priors, " + std::to_string(team.repeated) +
         " exact copies of other measurements\n";
}

}  // namespace km

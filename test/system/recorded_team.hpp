#pragma once

#include <yaml-cpp/yaml.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <string>

#include "modules/pose_graph/g2o_io.hpp"
#include "test/support/command.hpp"
#include "test/support/split_graph.hpp"

namespace km {

/// Writes what `robot` has recorded: its odometry and every closure that touches it.
inline void write_part(const SplitGraph& graph, RobotId robot, const std::filesystem::path& file) {
  G2oGraph part;
  for (const RelativePose& e : graph.odometry)
    if (e.from.robot == robot) part.edges.push_back(e);
  for (const RelativePose& e : graph.closures)
    if (e.from.robot == robot || e.to.robot == robot) part.edges.push_back(e);
  write_g2o(file, part);
}

/// The cost that kimera_multi_pgo comes to for the edges that robots 0 to `robots` - 1 have kept,
/// whose results are in robot0, robot1, ... of `folder`.
inline double solved_in_one_process(const std::filesystem::path& folder, int robots) {
  const std::filesystem::path parts = folder / "kept";
  std::filesystem::create_directory(parts);
  for (int k = 0; k < robots; ++k) {
    const std::string name = "robot" + std::to_string(k);
    std::filesystem::copy_file(folder / name / "pose_graph.g2o", parts / (name + ".g2o"));
  }
  const std::filesystem::path json = folder / "pgo.json";
  const CommandResult result =
      run_command(std::string(KM_BIN_DIR) + "/kimera_multi_pgo solve " + parts.string() +
                  " --method newton --trust-all --json " + json.string());
  CAPTURE(result.output);
  REQUIRE(result.exit_code == 0);
  return YAML::LoadFile(json.string())["rounded_cost"].as<double>();
}

}  // namespace km

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/config.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/io/folder_name.hpp"
#include "modules/evaluation/closure_truth.hpp"

namespace km {

/// True for a valid --rate of a robot: a positive number, max, or auto.
[[nodiscard]] bool is_rate(const std::string& text);

/// One robot of a team and its input: a sensor recording or a pose graph.
struct RobotPlan {
  RobotId id = 0;
  std::string name;
  std::filesystem::path dataset;
  std::filesystem::path graph;
  std::optional<double> from_s;
  std::optional<double> to_s;
  std::filesystem::path truth;
  std::vector<std::string> arguments;

  [[nodiscard]] std::string name_or_default() const {
    return name.empty() ? "robot" + std::to_string(id) : name;
  }

  void visit_fields(auto& visitor) {
    visitor.field("id", id, {0, 65535}, "unique in the team");
    visitor.field("name", name, "unique; also the name of its results folder; default: robot<id>");
    visitor.field("dataset", dataset, Input{}, "folder of images, or a bag (--rig); or");
    visitor.field("graph", graph, Input{}, "recorded pose graph: g2o, CSV or JRL");
    visitor.field("from", from_s, {0.0, 1e9}, "[s since the first image] part of the recording");
    visitor.field("to", to_s, {0.0, 1e9}, "[s since the first image]");
    visitor.field("truth", truth, Input{.must_exist = false},
                  "true poses of this robot; default: the team's");
    visitor.field("arguments", arguments,
                  "further options of its command line; their inputs (--rig, --odometry, ...) are "
                  "relative to this file");
    visitor.required({"id"});
    visitor.check(name.empty() || is_folder_name(name), "name",
                  "is not made of letters, digits, _, - and .");
    visitor.check(dataset.empty() != graph.empty(), "dataset", "or else graph is needed");
  }
};

/// A team to start on this host.
struct TeamPlan {
  std::vector<std::filesystem::path> configs;
  std::string rate = "auto";
  std::optional<std::uint32_t> domain;
  std::filesystem::path output;
  std::filesystem::path security;
  std::filesystem::path truth;
  std::filesystem::path truth_mesh;
  ClosureTruthOptions closure_truth;
  std::vector<std::string> arguments;
  std::vector<RobotPlan> robots;   ///< Robots with the team's settings applied.
  std::vector<std::string> notes;  ///< Missing inputs, for the table.
  bool record = false;  ///< Each robot writes a record for viewers; not a key of the file.
  bool view = false;    ///< Robots run with --view; not a key of the file.

  void visit_fields(auto& visitor) {
    visitor.field("config", configs, Input{}, "one or several files, as for kimera_multi_robot");
    visitor.field("rate", rate, "times real time, max, or auto");
    visitor.field("domain", domain, {0, 230}, "DDS domain; default: drawn at random");
    visitor.field("output", output,
                  "folder of the results, relative to the working directory; default: results/ "
                  "and this file's name");
    visitor.field("security", security, Input{},
                  "team folder of kimera_multi_keys: each robot uses the keys in its folder there");
    visitor.field("truth", truth, Input{.must_exist = false},
                  "true poses, in one common frame for all robots");
    visitor.field("truth_mesh", truth_mesh, Input{}, "PLY file in the frame of the true poses");
    visitor.section("closure_truth", closure_truth, "criteria for a true closure");
    visitor.field("arguments", arguments, "further options of the command line of every robot");
    visitor.sections("robots", robots);
    visitor.required({"robots"});
    visitor.check(is_rate(rate), "rate", "is neither a positive number nor max nor auto");
    for (std::size_t i = 0; i < robots.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const RobotPlan &one = robots[i], &other = robots[j];
        visitor.check(one.id != other.id, "robots", "repeat the id " + std::to_string(one.id), i);
        visitor.check(one.name_or_default() != other.name_or_default(), "robots",
                      "repeat the name " + one.name_or_default(), i);
      }
  }
};

/// Reads a team file. Relative paths of inputs, also in arguments, are relative to the file's
/// folder; ${DATASET} in them is replaced by `dataset`. A truth may be a folder that contains the
/// file. A missing truth adds a note. Throws ConfigError with every problem by file and line.
[[nodiscard]] TeamPlan read_team_file(const std::filesystem::path& file,
                                      const std::filesystem::path& dataset);

/// Documentation of the keys of a team file, with their defaults.
[[nodiscard]] std::string team_file_keys();

}  // namespace km

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/ids.hpp"

namespace km {

/// The command line of kimera_multi_robot.
struct RobotOptions {
  std::vector<std::filesystem::path> configs;  ///< In order; a later file overrides an earlier one.
  std::vector<std::string> settings;           ///< section.key=value, over all files.
  RobotId robot = 0;
  std::string name;  ///< "robot<id>" if not given.

  std::filesystem::path dataset;  ///< EuRoC/ASL folder; exclusive with `graph`.
  std::filesystem::path graph;    ///< Recorded pose graph, g2o or CSV.
  std::optional<double> from_s;   ///< Part of the recording [s since its first image].
  std::optional<double> to_s;
  double rate = 1.0;  ///< Times real time; infinity for as fast as possible.

  std::optional<int> domain;  ///< DDS domain; from the configuration if absent.
  std::string link;           ///< Name or file of a link profile; from the configuration if empty.
  std::vector<std::string> peers;
  std::string interface_name;

  std::filesystem::path output;
  double serve_limit_s = 120.0;  ///< Longest time to serve peers after the input has ended.
  std::string log_level = "info";
};

/// Parses the command line. Exits the process for --help and mistakes, after telling.
RobotOptions parse_options(int argc, char** argv);

}  // namespace km

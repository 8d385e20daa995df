#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace km {

/// One command of an experiment: what it reads and what it makes.
struct Step {
  std::string name;                                 ///< Unique; stem of its record and its log.
  std::string title;                                ///< For people.
  std::vector<std::string> command;                 ///< Program first.
  std::vector<std::filesystem::path> inputs = {};   ///< Files whose content decides the result.
  std::vector<std::filesystem::path> outputs = {};  ///< Files that are there once it is done.
  std::vector<std::string> needs = {};              ///< Names of steps that must be done before.
  /// Copied (from, to) before the command is run.
  std::vector<std::pair<std::filesystem::path, std::filesystem::path>> copies = {};
  /// Texts (file, content) written before the command is run.
  std::vector<std::pair<std::filesystem::path, std::string>> writes = {};
  bool adoptable = false;    ///< Outputs that are there without a record are taken as they are.
  double expected_s = 1.0;   ///< Roughly, on two cores.
  std::string missing = {};  ///< Why it cannot be run; empty if it can.
};

}  // namespace km

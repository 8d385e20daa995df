#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>

#include "test/support/command.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {

/// A finished run of kimera_multi_team: what it printed, and its --json.
struct TeamRun {
  CommandResult result;
  YAML::Node json;  ///< JSON is YAML.
};

/// Runs a team file on `dataset` as fast as it can, in a random DDS domain (the program draws it).
/// Results go to `folder`.
inline TeamRun run_team_file(const std::filesystem::path& team,
                             const std::filesystem::path& dataset, const TemporaryFolder& folder) {
  const std::string json = (folder.path() / "team.json").string();
  TeamRun run;
  run.result = run_command(std::string(KM_BIN_DIR) + "/kimera_multi_team --config " +
                           team.string() + " --dataset " + dataset.string() +
                           " --rate max --output " + folder.path().string() + " --json " + json +
                           " -- --serve-limit 1000");  // sanitizers are slow
  if (run.result.exit_code == 0) run.json = YAML::LoadFile(json);
  return run;
}

/// The same for a file of config/teams.
inline TeamRun run_team(const std::string& team, const std::filesystem::path& dataset,
                        const TemporaryFolder& folder) {
  return run_team_file("config/teams/" + team, dataset, folder);
}

}  // namespace km

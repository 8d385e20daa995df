#pragma once

#include <filesystem>
#include <optional>

namespace km {

/// Inputs of a run, stored with its results, so that `list`, `report` and later runs use them
/// without options. Paths are absolute; empty: not given.
struct RunInputs {
  std::filesystem::path data;
  std::filesystem::path graphs;
  std::filesystem::path euroc;
  std::filesystem::path config;
  bool quick = false;

  bool operator==(const RunInputs&) const = default;
};

/// nullopt if `results` has no readable inputs.
[[nodiscard]] std::optional<RunInputs> read_run_inputs(const std::filesystem::path& results);

/// Makes the folder. Throws std::runtime_error naming the file.
void write_run_inputs(const std::filesystem::path& results, const RunInputs& inputs);

}  // namespace km

#pragma once

#include <filesystem>
#include <optional>

namespace km {

/// Where a run took its inputs from: kept in its folder of results, so that `list`, `report` and
/// later runs look there without being told again. Paths are absolute; empty: none was given.
struct RunInputs {
  std::filesystem::path data;
  std::filesystem::path graphs;
  std::filesystem::path euroc;
  std::filesystem::path config;
  bool quick = false;

  bool operator==(const RunInputs&) const = default;
};

/// nullopt if nothing was kept in `results`, or nothing that can be read.
[[nodiscard]] std::optional<RunInputs> read_run_inputs(const std::filesystem::path& results);

/// Makes the folder. Throws std::runtime_error naming the file.
void write_run_inputs(const std::filesystem::path& results, const RunInputs& inputs);

}  // namespace km

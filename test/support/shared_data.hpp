#pragma once

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>

namespace km {

/// Path of a piece of the recorded data, or nullopt after printing the line by which ctest counts
/// the test as skipped. The folder comes from KIMERA_MULTI_DATA, by default ../shared/data beside
/// the repository (tests run in the repository's root).
inline std::optional<std::filesystem::path> shared_data(const std::string& relative) {
  const char* root = std::getenv("KIMERA_MULTI_DATA");
  const std::filesystem::path path =
      std::filesystem::path(root != nullptr ? root : "../shared/data") / relative;
  if (std::filesystem::exists(path)) return path;
  std::cout << "SKIPPED: no recorded data at " << path << "; set KIMERA_MULTI_DATA\n";
  return std::nullopt;
}

}  // namespace km

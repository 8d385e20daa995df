#pragma once

#include <filesystem>

namespace km {

/// Folder of the running program; other programs are beside it, and its configuration is near.
[[nodiscard]] inline std::filesystem::path program_folder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

}  // namespace km

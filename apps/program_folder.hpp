#pragma once

#include <filesystem>

namespace km {

/// Where the running program lies: other programs are beside it, its configuration is near.
[[nodiscard]] inline std::filesystem::path program_folder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

}  // namespace km

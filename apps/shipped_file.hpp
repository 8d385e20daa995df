#pragma once

#include <filesystem>
#include <string>

namespace km {

/// Folder of the running program; other programs are beside it, and its configuration is near.
[[nodiscard]] inline std::filesystem::path program_folder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

/// Path of a file that comes with the program, such as "vocabulary/indoor.kmvoc" or
/// "qos/wifi.yaml". Tries `name` as it is, then below config/ of the source tree or of the
/// installation from which this program runs. Throws ConfigError that names `key`, whose value
/// `name` is, and all places that were tried.
[[nodiscard]] std::filesystem::path find_shipped_file(const std::string& name, const char* key);

/// `name` if it is a file. Otherwise the file of this folder of config/ with this name, or the only
/// one whose name ends with it: "euroc" for datasets/euroc.yaml, "d455" for
/// rigs/realsense_d455.yaml. Throws ConfigError that lists the names.
[[nodiscard]] std::filesystem::path find_named_file(const std::string& folder,
                                                    const std::string& name);

}  // namespace km

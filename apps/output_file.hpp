#pragma once

#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <string>

#include "modules/core/write_file.hpp"

namespace km {

/// Writes `file` by `writer(std::ostream&)`; nothing if the name is empty. See write_file(): whole
/// or not at all. Throws std::runtime_error that names the file and why.
inline void write_output(const std::filesystem::path& file, const auto& writer) {
  if (file.empty()) return;
  std::ostringstream out;
  writer(out);
  write_file(file, out.view());
}

/// Throws std::runtime_error if there is no folder to write `file` to, or if it is one (empty: none
/// asked for): told before the work is done, not after.
inline void check_output_folder(const std::filesystem::path& file) {
  if (file.empty()) return;
  const std::filesystem::path folder = std::filesystem::absolute(file).parent_path();
  if (!std::filesystem::is_directory(folder))
    throw std::runtime_error(file.string() + ": cannot be written, there is no folder " +
                             folder.string());
  if (std::filesystem::is_directory(file))
    throw std::runtime_error(file.string() + ": cannot be written, it is a folder");
}

}  // namespace km
